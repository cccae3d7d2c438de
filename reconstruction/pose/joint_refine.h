// Outer loop of the joint solve: find the contour generators, match them to the photographs,
// condense, solve the rig; again until nothing moves.
#pragma once

#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "drivers/base/progress.h"
#include "reconstruction/mesh/mesh.h"
#include "reconstruction/pose/contour_evidence.h"
#include "reconstruction/pose/contour_sample.h"
#include "reconstruction/pose/diagnostics.h"
#include "reconstruction/pose/rig_solve.h"

namespace scan {

struct RefineOptions {
  double first_window_px = 64;  // search along the normal; shrinks with the residuals
  double last_window_px = 8;
  double spacing_px = 4;  // of contour samples
  // A view whose stated sigma moves its image by more starts from its silhouette's centroid.
  double centre_beyond_px = 16;
  // Contour that counts as one independent observation is estimated from the residuals of all
  // views, and is at least this: real residuals are model discrepancy. What of it views share is
  // estimated as well, and counts once for all that see a place.
  double correlation_floor_px = 43;
  double sigma_floor_px = 0.15;  // sub-pixel contours; binary masks add a pixel's quantisation
  int max_iterations = 40;
  double converged_px = 0.01;  // largest motion of any view's surface in the last step
};

// 1 px of a picture 1848 px wide, in those of the pictures that `options` are scaled to; not less
// than a half.
inline double UnitPx(const RefineOptions& options) { return options.last_window_px / 8; }

// How the residuals of a solve hang together.
struct ResidualCorrelation {
  double along_px = 0;       // of contour that counts as one independent observation
  double between_views = 0;  // share that views of the same place have in common
  double place_mm = 1;       // width of such a place: that of `along_px` on the specimen
};

struct ViewFit {
  MatchResult match;
  double sigma_px = 0;                        // robust scale of the residuals, floored
  std::vector<BeadSighting> beads;            // of the photograph
  std::optional<CondensedEvidence> evidence;  // of contour and beads
};

// The scale of residuals that views agree on: the median of those that took part; 0 without any.
double PooledSigma(std::span<const ViewFit> fits);

struct RefineResult {
  RigParameters parameters;
  std::vector<ViewFit> fits;        // at `parameters`
  double cost = 0;                  // of the last rig solve
  ResidualCorrelation correlation;  // used for the weights
  int iterations = 0;
  bool converged = false;
  std::vector<SolveStep> steps;  // one for each iteration; earlier solves' first where Continued
};

// `later`, which started where `earlier` ended, with the steps of both.
RefineResult Continued(const RefineResult& earlier, RefineResult later);

// `use[i]` is false for views that take no part; photos[i] may then be empty.
// Parallel over the views inside; the same bytes for any number of threads. Stops early, not
// converged, when asked to.
RefineResult RefineJoint(const ContourMesh& mesh, const RigModel& rig,
                         std::span<const PhotoContour> photos, const std::vector<bool>& use,
                         const RigParameters& start, const RefineOptions& options,
                         std::stop_token stop);

// Matches and condenses one photograph at `state`. Thread contract: pure.
ViewFit FitView(const ContourMesh& mesh, const PhotoContour& photo, const ViewState& state,
                double window_px, const ResidualCorrelation& correlation,
                const RefineOptions& options);

// Matches and condenses every view in use at given parameters, without solving.
std::vector<ViewFit> FitViews(const ContourMesh& mesh, const RigModel& rig,
                              std::span<const PhotoContour> photos, const std::vector<bool>& use,
                              const RigParameters& parameters, double window_px,
                              const ResidualCorrelation& correlation, const RefineOptions& options);

}  // namespace scan
