// The simulated board under the contract of GPIO lines.
#include "drivers/io/gpio/sim_gpio_board.h"
#include "tests/contract/gpio_contract.h"

namespace scan {
namespace {

GpioTwin MakeSim(GpioAfterExit after_exit) {
  const auto clock = std::make_shared<SystemClock>();
  const auto board = std::make_shared<SimGpioBoard>(
      "sim-board", std::vector<std::string>{"", "A", "B", "C", "D"}, clock, after_exit);
  GpioTwin twin{"sim-board", "A", "B", "C", "D", 1, board->Opener(), {}, {}, {}, board};
  twin.level = [board](const std::string& line) { return board->Level(line); };
  twin.drive = [board](const std::string& line, bool high) { board->Drive(line, high); };
  twin.now_ns = [clock] { return clock->Now().mono_ns; };
  return twin;
}

INSTANTIATE_TEST_SUITE_P(
    Sim, GpioContract,
    ::testing::Values(GpioTwinFactory{"released", [] { return MakeSim(GpioAfterExit::released); }},
                      GpioTwinFactory{"kept", [] { return MakeSim(GpioAfterExit::kept); }}),
    [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace scan
