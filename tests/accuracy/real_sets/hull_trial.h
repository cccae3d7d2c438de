// Half of the photographs of a real set make the mesh, the other half are posed on it.
#pragma once

#include "drivers/base/result.h"
#include "reconstruction/evaluate/calibrated.h"
#include "tests/accuracy/real_sets/real_set.h"
#include "tests/accuracy/real_sets/visual_hull.h"

namespace scan::test {

struct HullTrialOptions {
  bool hull_of_all = false;        // as a control: the hull of the posed photographs as well
  std::size_t most_posed = 10000;  // of the other half, evenly spread
};

struct HullTrial {
  std::size_t hull_views = 0;
  TriangleMesh hull;  // of every second whole photograph, at the calibrated cameras
  RealSet posed;      // the other whole ones
  Poses poses;        // of these, by SolveJoint
  double hull_seconds = 0, solve_seconds = 0;
};
// Errors: those of VisualHull and SolveJoint. Thread contract: pure; parallel inside.
Result<HullTrial> RunHullTrial(const RealSet& set, const HullTrialOptions& options = {});

// Of every posed view, accepted or not; rotations without any alignment of the frames.
struct HullFigures {
  CalibratedFigures calibrated;
  std::size_t accepted = 0;
  std::vector<double> rotation_deg, centre_mm;
  std::vector<double> sigma_deg;    // of accepted rotations, as the solver reports it
  std::vector<double> azimuth_deg;  // of the rotation's error: about the model's z axis
  std::vector<double> nominal_deg;  // of the nominal poses, where there are some
};
Result<HullFigures> FiguresOf(const HullTrial& trial);

// The photograph with its outline (green), that of the hull at the calibrated (blue) and at the
// solved camera (red). Errors: failed when the file cannot be written.
Status WriteOverlay(const HullTrial& trial, std::size_t view, const std::filesystem::path& png);

}  // namespace scan::test
