// A PTP camera on a simulated DSLR and a virtual clock.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <opencv2/core.hpp>
#include <utility>

#include "drivers/base/virtual_clock.h"
#include "drivers/camera/encode_picture.h"
#include "drivers/camera/ptp/ptp_camera.h"
#include "drivers/camera/ptp/sim_dslr.h"

namespace scan {

// Every exposure has a picture of its own.
inline std::vector<std::byte> SimDslrJpeg(int exposure) {
  const cv::Mat picture(48, 64, CV_8UC3, cv::Scalar(exposure % 256, 128, exposure / 256));
  return EncodePicture(picture, "jpg", 90).value().bytes;
}

struct PtpBench {
  explicit PtpBench(DslrKind kind = DslrKind::nikon, PtpCameraOptions options = {})
      : clock(std::make_shared<VirtualClock>()), wish(std::move(options)) {
    SimDslrOptions simulated;
    simulated.kind = kind;
    simulated.jpeg = SimDslrJpeg;
    dslr = std::make_shared<SimDslr>(std::move(simulated), clock);
    wish.w = 64;
    wish.h = 48;
    if (kind == DslrKind::plain) wish.config.target = "card";
  }

  Status Open(std::unique_ptr<ShutterLines> lines = nullptr) {
    SCAN_TRY(camera, PtpCamera::Open(wish, dslr, std::move(lines), clock));
    return {};
  }
  std::int64_t now_ns() { return clock->Now().mono_ns; }

  std::shared_ptr<VirtualClock> clock;
  std::shared_ptr<SimDslr> dslr;
  PtpCameraOptions wish;
  std::unique_ptr<PtpCamera> camera;
};

}  // namespace scan
