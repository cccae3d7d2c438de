// libcamera's real twin, in its worker, on the camera that is plugged in.
#include <gtest/gtest.h>

#include "firmware-host/devices/open_libcamera.h"
#include "tests/contract/twin.h"

namespace scan {
namespace {

TwinFactory<Camera> Factory(std::string name, const std::string& pixel_format) {
  return {std::move(name), [pixel_format] {
            LibcameraOptions options;
            options.w = 640;
            options.h = 480;
            options.config.pixel_format = pixel_format;
            options.config.timeout_ms = 20'000;  // the guest's processor is emulated
            auto camera = OpenLibcamera(options);
            EXPECT_TRUE(camera) << ToString(camera.error());
            Twin<Camera> twin;
            twin.clock = std::make_shared<SystemClock>();
            if (camera) twin.device = std::move(*camera);
            return twin;
          }};
}

INSTANTIATE_TEST_SUITE_P(Libcamera, CameraContract,
                         ::testing::Values(Factory("mjpeg", "MJPEG"), Factory("yuyv", "YUYV")),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace scan
