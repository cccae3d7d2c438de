#include "tests/accuracy/efficiency.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace scan::test {

EfficiencyBench::EfficiencyBench(TriangleMesh mesh, const Fig12Options& fig12)
    : mesh_(std::move(mesh)), fig12_(fig12) {
  Fig12Options tiny = fig12_;  // the cameras do not depend on the pictures
  tiny.noise = {};
  tiny.samples = 1;
  const PoseTrial trial = MakeFig12Trial(mesh_, tiny);
  information_.resize(trial.truth.size());
  tbb::parallel_for(std::size_t{0}, information_.size(),
                    [&](std::size_t i) { information_[i] = InformationOf(mesh_, trial.truth[i]); });
}

Result<Efficiency> EfficiencyBench::Measure(const ContourNoise& noise, double bias_sigma_px) const {
  Fig12Options fig12 = fig12_;
  fig12.noise = noise;
  const PoseTrial trial = MakeFig12Trial(mesh_, fig12);
  JointOptions joint;
  joint.rig.mask_bias_px = bias_sigma_px * 1848 / fig12.w;
  // The mesh is exact: residuals are the noise alone.
  joint.refine.correlation_floor_px = 2.0 * 1848 / fig12.w;
  // What is measured is the end of the search, not its reach.
  joint.view_start.candidates = 12;
  joint.view_start.finalists = 3;
  SCAN_TRY(const Poses poses, SolveEachAlone(trial, joint));
  const MethodFigures figures = ScorePoses(trial, poses, {});
  Efficiency e;
  const double n = static_cast<double>(information_.size());
  for (std::size_t i = 0; i < information_.size(); ++i) {
    const auto bound = BoundOf(information_[i], noise, bias_sigma_px);
    if (!bound)
      return BadInput("the outline leaves a direction free", poses.views[i].name,
                      "take another specimen");
    const PoseError& error = figures.views[i].error;
    ++e.views;
    e.accepted += figures.views[i].accepted;
    e.worst_centre_ratio = std::max(e.worst_centre_ratio, error.centre_mm / bound->centre_mm);
    e.mean_nees += figures.views[i].nees / n;
    e.centre_rms_mm += error.centre_mm * error.centre_mm / n;
    e.centre_bound_mm += bound->centre_mm * bound->centre_mm / n;
    e.surface_rms_px += error.surface_rms_px * error.surface_rms_px / n;
    e.surface_bound_px += bound->surface_px * bound->surface_px / n;
    e.skipped += information_[i].skipped / n;
  }
  for (double* squares :
       {&e.centre_rms_mm, &e.centre_bound_mm, &e.surface_rms_px, &e.surface_bound_px})
    *squares = std::sqrt(*squares);
  e.centre_ratio = e.centre_rms_mm / e.centre_bound_mm;
  e.surface_ratio = e.surface_rms_px / e.surface_bound_px;
  return e;
}

}  // namespace scan::test
