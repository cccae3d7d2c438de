// A V4L2 camera on a simulated driver and a virtual clock.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "drivers/base/virtual_clock.h"
#include "drivers/camera/v4l2/v4l2_camera.h"
#include "tests/support/simulated_v4l2.h"

namespace scan {

constexpr std::int64_t kSecondNs = 1'000'000'000;

struct V4l2Bench {
  explicit V4l2Bench(SimulatedV4l2Options simulated = {}, V4l2CameraOptions options = {})
      : clock(std::make_shared<VirtualClock>()),
        system(std::make_shared<SimulatedV4l2>(std::move(simulated), clock)),
        wish(std::move(options)) {}

  Status Open() {
    SCAN_TRY(camera, V4l2Camera::Open(wish, system, clock));
    return {};
  }
  std::int64_t now_ns() { return clock->Now().mono_ns; }
  void ExpectNothingHeld() {
    EXPECT_EQ(system->open_descriptors(), 0);
    EXPECT_EQ(system->live_mappings(), 0);
    EXPECT_EQ(system->live_buffers(), 0);
  }

  std::shared_ptr<VirtualClock> clock;
  std::shared_ptr<SimulatedV4l2> system;
  V4l2CameraOptions wish;
  std::unique_ptr<V4l2Camera> camera;
};

}  // namespace scan
