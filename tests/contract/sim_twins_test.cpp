// The simulated twins under the contract suites (and the system's clock, which needs no hardware).
#include "drivers/base/virtual_clock.h"
#include "drivers/station/sim_station.h"
#include "tests/contract/twin.h"

namespace scan {
namespace {

Result<cv::Mat> RenderGrey(const TrueState& state) {
  return cv::Mat(state.intrinsics.h, state.intrinsics.w, CV_8UC3, cv::Scalar::all(120));
}

struct SimRig {
  std::shared_ptr<SimWorld> world;
  std::shared_ptr<VirtualClock> clock;
  Station station;
};

std::shared_ptr<SimRig> MakeRig(ErrorLevel level, const std::string& format) {
  StationConfig config = DefaultSimStation();
  config.sim.errors = DefaultSimErrors(level);
  config.sim.errors.late_frames = 0;  // a fault that breaks the camera's contract on purpose
  config.sim.format = format;
  config.cameras[0].w = 120;
  config.cameras[0].h = 80;
  auto rig = std::make_shared<SimRig>();
  rig->world = std::make_shared<SimWorld>(config);
  rig->clock = std::make_shared<VirtualClock>();
  auto station = MakeSimStation(config, rig->world, rig->clock, RenderGrey);
  if (station) rig->station = std::move(*station);
  return rig;
}

template <class Device>
TwinFactory<Device> SimFactory(std::string name, ErrorLevel level, const std::string& format,
                               std::unique_ptr<Device> (*take)(Station&)) {
  return {std::move(name), [level, format, take] {
            auto rig = MakeRig(level, format);
            Twin<Device> twin;
            twin.clock = rig->clock;
            twin.activity = rig->clock.get();
            twin.device = take(rig->station);
            twin.world = rig;
            return twin;
          }};
}

std::unique_ptr<Motion> TakeMotion(Station& station) { return std::move(station.motion); }
std::unique_ptr<Camera> TakeCamera(Station& station) { return std::move(station.cameras["c0"]); }
std::unique_ptr<Light> TakeLight(Station& station) { return std::move(station.light); }

constexpr auto kName = [](const auto& instance) { return instance.param.name; };

INSTANTIATE_TEST_SUITE_P(
    Sim, MotionContract,
    ::testing::Values(SimFactory("ideal", ErrorLevel::ideal, "jpg", TakeMotion),
                      SimFactory("static", ErrorLevel::static_errors, "jpg", TakeMotion),
                      SimFactory("dynamic", ErrorLevel::dynamic, "jpg", TakeMotion)),
    kName);
INSTANTIATE_TEST_SUITE_P(
    Sim, CameraContract,
    ::testing::Values(SimFactory("jpg", ErrorLevel::static_errors, "jpg", TakeCamera),
                      SimFactory("png", ErrorLevel::dynamic, "png", TakeCamera)),
    kName);
INSTANTIATE_TEST_SUITE_P(Sim, LightContract,
                         ::testing::Values(SimFactory("ideal", ErrorLevel::ideal, "jpg",
                                                      TakeLight)),
                         kName);

Twin<Clock> MakeVirtualClock() {
  auto clock = std::make_unique<VirtualClock>();
  Twin<Clock> twin;
  twin.activity = clock.get();
  twin.device = std::move(clock);
  return twin;
}
Twin<Clock> MakeSystemClock() {
  Twin<Clock> twin;
  twin.device = std::make_unique<SystemClock>();
  return twin;
}

INSTANTIATE_TEST_SUITE_P(Clocks, ClockContract,
                         ::testing::Values(TwinFactory<Clock>{"virtual", MakeVirtualClock},
                                           TwinFactory<Clock>{"system", MakeSystemClock}),
                         kName);

}  // namespace
}  // namespace scan
