// The libcamera driver on its simulated twin under the contract suite.
#include "drivers/base/virtual_clock.h"
#include "drivers/camera/libcamera/libcamera_camera.h"
#include "tests/contract/twin.h"
#include "tests/support/simulated_libcamera.h"

namespace scan {
namespace {

TwinFactory<Camera> Factory(std::string name, const std::string& format, bool reports) {
  return {std::move(name), [format, reports] {
            SimulatedLibcameraOptions simulated;
            simulated.format = format;
            simulated.reports_settings = simulated.reports_stamp = reports;
            auto clock = std::make_shared<VirtualClock>();
            LibcameraOptions options;
            options.config.camera = "simsensor";
            auto camera = LibcameraCamera::Open(
                options, std::make_shared<SimulatedLibcamera>(simulated, clock), clock);
            EXPECT_TRUE(camera) << ToString(camera.error());
            Twin<Camera> twin;
            twin.clock = clock;
            twin.activity = clock.get();
            if (camera) twin.device = std::move(*camera);
            return twin;
          }};
}

INSTANTIATE_TEST_SUITE_P(LibcameraSimulated, CameraContract,
                         ::testing::Values(Factory("reports", "YUYV", true),
                                           Factory("reports_nothing", "MJPEG", false)),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace scan
