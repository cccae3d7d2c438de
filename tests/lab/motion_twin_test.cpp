// Motion through libgpiod on the kernel's lines, under the contract of Motion.
#include "tests/contract/twin.h"
#include "tests/lab/lab_station.h"

namespace scan {
namespace {

Twin<Motion> MakeReal() {
  const auto station = std::make_shared<LabStation>(LabStation::Make());
  Twin<Motion> twin;
  twin.world = station;
  twin.clock = station->clock;
  twin.device = station->MakeMotion();
  return twin;
}

INSTANTIATE_TEST_SUITE_P(Kernel, MotionContract,
                         ::testing::Values(TwinFactory<Motion>{"gpiod", MakeReal}),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace scan
