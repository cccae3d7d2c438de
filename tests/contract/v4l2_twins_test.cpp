// The V4L2 camera on a simulated driver under the contract suite.
#include "tests/contract/twin.h"
#include "tests/support/v4l2_bench.h"

namespace scan {
namespace {

TwinFactory<Camera> Factory(std::string name, const std::string& pixel_format, int held_frames) {
  return {std::move(name), [pixel_format, held_frames] {
            SimulatedV4l2Options simulated;
            simulated.held_frames = held_frames;
            V4l2CameraOptions options;
            options.config.pixel_format = pixel_format;
            auto bench = std::make_shared<V4l2Bench>(simulated, options);
            Twin<Camera> twin;
            const Status opened = bench->Open();
            EXPECT_TRUE(opened) << ToString(opened.error());
            twin.clock = bench->clock;
            twin.activity = bench->clock.get();
            twin.device = std::move(bench->camera);
            twin.world = bench;
            return twin;
          }};
}

INSTANTIATE_TEST_SUITE_P(V4l2Simulated, CameraContract,
                         ::testing::Values(Factory("mjpg", "MJPG", 1), Factory("yuyv", "YUYV", 0)),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace scan
