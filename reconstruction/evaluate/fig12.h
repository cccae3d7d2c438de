// The protocol of Ijiri et al. 2018, Fig 12: random cameras, each to be found alone.
#pragma once

#include <cstdint>
#include <stop_token>

#include "drivers/base/progress.h"
#include "drivers/base/result.h"
#include "reconstruction/evaluate/drawn_mask.h"
#include "reconstruction/evaluate/pose_trial.h"

namespace scan {

struct Fig12Options {
  int cameras = 100;
  double focal_mm = 105, sensor_mm = 23.6;
  int w = 462, h = 306;  // 1/8 of 3696 x 2448
  // r from [540, 560] mm, theta and delta_x from [0, 2 pi], phi from +-0.35 pi, delta_y and delta_z
  // from +-0.006 pi.
  double r0_mm = 550;
  int samples = 8;  // squared: points of coverage in each pixel
  std::uint64_t seed = 12;
  ContourNoise noise;  // of each photograph's mask, independent between them
};

// Photographs of `mesh` (model frame, mm) as masks of area coverage, with the stated errors of
// their outlines; without any logged pose, all with the stated focal length and r0. Same bytes for
// any number of threads.
PoseTrial MakeFig12Trial(const TriangleMesh& mesh, const Fig12Options& options);

// SolveJoint on each photograph alone, nothing shared between them. Poses as if from one call.
// Errors: those of SolveJoint.
Result<Poses> SolveEachAlone(const PoseTrial& trial, const JointOptions& options,
                             const ProgressFn& progress = {}, std::stop_token stop = {});

}  // namespace scan
