// The kernel's GPIO lines, through libgpiod, under the contract of GPIO lines.
#include "drivers/base/clock.h"
#include "drivers/io/gpio/gpiod_lines.h"
#include "tests/contract/gpio_contract.h"
#include "tests/lab/motor_model.h"

namespace scan {
namespace {

GpioTwin MakeReal() {
  const auto board = LabBoardFromEnvironment();
  EXPECT_TRUE(board) << ToString(board.error());
  const std::map<std::string, unsigned> numbers{
      {"TURNTABLE_STEP", 0}, {"ESTOP", 9}, {"COVER", 10}, {"LAMP", 11}};
  GpioTwin twin{
      "scan-lab", "TURNTABLE_STEP", "LAMP", "COVER", "ESTOP", 0, OpenGpiodLines, {}, {}, {}, {}};
  twin.level = [=](const std::string& line) { return ReadLevel(*board, numbers.at(line)).value(); };
  twin.drive = [=](const std::string& line, bool high) {
    EXPECT_TRUE(DriveLevel(*board, numbers.at(line), high));
  };
  twin.now_ns = [] { return SystemClock().Now().mono_ns; };
  return twin;
}

INSTANTIATE_TEST_SUITE_P(Kernel, GpioContract,
                         ::testing::Values(GpioTwinFactory{"gpiod", MakeReal}),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace scan
