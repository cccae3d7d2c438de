// Photographs with known cameras: a pose method against the truth, in figures for a table.
#pragma once

#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "acquisition/session/photo_set.h"
#include "drivers/base/progress.h"
#include "drivers/base/result.h"
#include "reconstruction/masks/mask.h"
#include "reconstruction/mesh/mesh.h"
#include "reconstruction/pose/paper/solve_paper.h"
#include "reconstruction/pose/poses.h"
#include "reconstruction/pose/score.h"
#include "reconstruction/pose/solve_joint.h"

namespace scan {

struct PoseTrial {
  PhotoSet photos;
  std::vector<Mask> masks;    // one per photo
  TriangleMesh mesh;          // what the solvers get, model frame, mm
  TriangleMesh surface;       // the true one, same frame
  std::vector<PoseOf> truth;  // one per photo
};

// The photos named by `indices`, in that order.
PoseTrial Subset(const PoseTrial& trial, std::span<const std::size_t> indices);

// `count` of `total` indices, evenly spread; all of them when there are no more.
std::vector<std::size_t> EvenlySpread(std::size_t total, std::size_t count);

struct ViewFigures {
  std::string name;
  bool accepted = false;
  std::string reason;                  // of the rejection
  double cost_px = 0, cost_l1_px = 0;  // Eq 3, picture reduced to 462 px
  PoseError error;                     // as found
  PoseError turned;                    // after the common turn about the free axes, see ScorePoses
  // Normalised error squared of the reported covariance, of `turned`; 6 degrees of freedom.
  double nees = 0;
  double centre_sigma_mm = 0;  // reported: the root of the trace of the centre's covariance
};

struct MethodFigures {
  std::string method;
  std::vector<ViewFigures> views;
  std::vector<FreeDirection> free_directions;  // that the method reports
  double seconds = 0;
};

// Compares with the truth. What nobody can see is not held against anyone: for each rotation in
// `free` (model frame) one turn about its axis, common to all accepted views of its mounting (or of
// its one view, as it says), is taken off in `turned`; without any, `turned` equals `error`. Thread
// contract: pure; parallel inside; the same bytes for any number of threads. Precondition: one view
// per photo.
MethodFigures ScorePoses(const PoseTrial& trial, const Poses& poses,
                         std::span<const FreeDirection> free);

// Error of the turn about a rotation's axis (model frame), rad in (-pi, pi], of every accepted view
// that it concerns. Thread contract: pure.
std::vector<double> TurnErrors(const PoseTrial& trial, const Poses& poses,
                               const FreeDirection& free);

// One row of the table.
struct MethodSummary {
  std::size_t views = 0, accepted = 0;
  std::size_t wrong = 0;  // accepted, but the surface is off by more than `wrong_px` RMS
  Spread centre_mm, rotation_deg, surface_px, cost_px;  // of accepted views, `turned`
  Spread centre_raw_mm, surface_raw_px;                 // of accepted views, as found
  double mean_nees = 0;
  // RMS of the centre's errors as found, and over that of the reported sigmas.
  double centre_rms_mm = 0, centre_per_sigma = 0;
};
MethodSummary Summarise(const MethodFigures& figures, double wrong_px);

// Views as close as that to the truth as found, accepted or not.
std::size_t CountWithin(const MethodFigures& figures, double centre_mm, double rotation_deg);

// The lines of a table for a terminal; `per_view` adds one line a view.
std::string TableOf(std::span<const MethodFigures> methods, double wrong_px, bool per_view);

}  // namespace scan
