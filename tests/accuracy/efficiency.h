// Poses of random cameras, each photograph alone, against the bound of each.
#pragma once

#include <vector>

#include "drivers/base/result.h"
#include "reconstruction/evaluate/fig12.h"
#include "tests/accuracy/pose_bound.h"

namespace scan::test {

struct Efficiency {
  std::size_t views = 0, accepted = 0;
  // Over all views: the roots of the sums of squares, errors over bounds.
  double centre_ratio = 0, surface_ratio = 0;
  double worst_centre_ratio = 0;  // of one view
  double mean_nees = 0;
  double centre_rms_mm = 0, centre_bound_mm = 0;
  double surface_rms_px = 0, surface_bound_px = 0;
  double skipped = 0;  // share of the outlines without a derivative, mean
};

// A specimen's mesh with the cameras of one protocol, whose noise may vary.
class EfficiencyBench {
 public:
  // Of `fig12` all but the noise.
  EfficiencyBench(TriangleMesh mesh, const Fig12Options& fig12);
  // `bias_sigma_px`: prior of the mask bias, for the solver and for the bound.
  // Errors: those of SolveJoint; an outline that leaves a direction free.
  Result<Efficiency> Measure(const ContourNoise& noise, double bias_sigma_px) const;

 private:
  TriangleMesh mesh_;
  Fig12Options fig12_;
  std::vector<OutlineInformation> information_;
};

}  // namespace scan::test
