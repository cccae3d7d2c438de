// What is really so in the simulated world at one instant: the input of its renderer.
#pragma once

#include <functional>
#include <opencv2/core.hpp>

#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "drivers/base/result.h"

namespace scan {

// Thread contract: plain value. Kept out of the session; tests and the demo score against it.
struct TrueState {
  double turntable_rad = 0;  // where the platter truly is
  double lift_mm = 0;        // where the carriage truly is
  CameraFromModel camera_from_model;
  Intrinsics intrinsics;
  bool specimen_present = true;  // false while the background plate is taken
  bool light_on = true;
  double exposure_us = 0;
  std::uint64_t noise_seed = 0;
};

// Renders the picture of a state: CV_8UC3, BGR, sRGB, intrinsics.w x intrinsics.h, before sensor
// noise. Given by the composition root, so that drivers never know the reconstruction.
using SceneRenderer = std::function<Result<cv::Mat>(const TrueState&)>;

}  // namespace scan
