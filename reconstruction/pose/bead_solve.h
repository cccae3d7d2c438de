// The joint solve continued with beads: which patch is which bead, how far the specimen is turned
// where its outline does not show it, and all again with the beads as evidence.
#pragma once

#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "reconstruction/pose/bead_views.h"
#include "reconstruction/pose/observability.h"
#include "reconstruction/pose/rig_attempt.h"

namespace scan {

struct BeadOptions {
  BeadMatchOptions match;
  // A turn explains as much as the best when its score is this share of the best's.
  double as_good = 0.8;
  double seen_share = 1.0 / 3;  // a bead seen less often than this, where it should be, is left out
  std::size_t least_sightings = 3;  // of a mounting; 2 of one that is a single view
};

// How well turns of a mounting about an axis of the model put the beads on patches of their colour.
struct BeadTurns {
  double best_rad = 0, best = 0;      // the best turn and its score: recognised beads, less half of
                                      // the missed ones
  double as_is = 0;                   // of no turn
  double second_rad = 0, second = 0;  // of the best that is no neighbour of it
  double neighbour_rad = 0;           // turns closer than this to each other are neighbours
};

struct BeadView {
  ViewState state;
  std::span<const BeadImage> images;
};

// All turns about the axis in steps of half a bead. Nothing where the beads lie on the axis.
// Thread contract: pure; parallel inside; the same for any number of threads.
std::optional<BeadTurns> ScoreTurns(const BeadScene& scene, std::span<const BeadView> views,
                                    const Screw& axis, const BeadMatchOptions& options);

struct BeadOutcome {
  std::size_t sightings = 0;
  double residual_px = 0;          // RMS of both components, of those sightings
  bool turned = false;             // a mounting was
  std::vector<std::string> notes;  // sentences for the report
};

// Fills photos[i].beads and solves again; turns the starts of mountings whose beads are recognised
// only then. Where a second turn explains the beads as well, or too few are recognised, that
// mounting's photographs get none and a note says so. `findings.images`: one list per photo.
// Parallel inside; the same bytes for any number of threads.
BeadOutcome SolveWithBeads(const ContourMesh& mesh, const BeadFindings& findings,
                           const BeadOptions& options, const RefineOptions& refine,
                           const ObservabilityOptions& observability,
                           std::span<PhotoContour> photos, RigAttempt& attempt,
                           std::stop_token stop);

}  // namespace scan
