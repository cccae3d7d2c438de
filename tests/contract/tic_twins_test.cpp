// Motion on Tic boards under the contract of Motion: the driver itself, on simulated boards.
#include "tests/contract/twin.h"
#include "tests/support/tic_bench.h"

namespace scan {
namespace {

Twin<Motion> MakeTic() {
  auto bench = std::make_shared<TicBench>();
  Twin<Motion> twin;
  twin.clock = bench->clock;
  twin.activity = dynamic_cast<Activity*>(bench->clock.get());
  twin.device = bench->Make();
  twin.world = bench;
  return twin;
}

INSTANTIATE_TEST_SUITE_P(Tic, MotionContract,
                         ::testing::Values(TwinFactory<Motion>{"simulated_boards", MakeTic}),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace scan
