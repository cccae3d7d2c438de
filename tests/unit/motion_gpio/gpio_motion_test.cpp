// Turntable and lift on a simulated board, on the machine's own clock: what needs no kernel driver.
#include "drivers/motion/gpio/gpio_motion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <thread>

#include "drivers/io/gpio/sim_gpio_board.h"

namespace scan {
namespace {

using ::testing::HasSubstr;

enum Line : unsigned { kTurnStep, kTurnDir, kTurnEn, kLiftStep, kLiftDir, kLiftEn };

AxisConfig SmallAxis(const char* name, HomingKind kind, int direction) {
  AxisConfig axis;
  axis.name = name;
  axis.unit = "mm";
  axis.steps_per_unit = 10;
  axis.velocity = 400;  // a start at any rate: the machine may be busy, a late step only shifts
  axis.acceleration = 4000;
  axis.self_start = 400;
  // Slow beside the milliseconds that news of a switch takes on a busy machine.
  axis.homing = {kind, direction, 0, 20, 3, 1.5, 30};
  axis.settle_ns = 100'000'000;
  return axis;
}

// Motors of two axes whose switches are at 0: the lift's below it, the turntable's above.
struct Bench {
  Bench() {
    board->Listen([this](unsigned line, bool high) {
      level[line] = high;
      if (!high || (line != kTurnStep && line != kLiftStep)) return;
      if (level[line + 2]) return;  // no current
      position[line] += level[line + 1] ? 1 : -1;
      ++edges;
    });
    switches = std::jthread([this](std::stop_token stop) {
      while (!stop.stop_requested()) {
        board->Drive("INDEX", position[kTurnStep] >= 0);
        board->Drive("ENDSTOP", position[kLiftStep] <= 0);
        SystemClock().SleepFor(200'000);
      }
    });
    parts.turntable = SmallAxis("turntable", HomingKind::index, 1);
    parts.lift = SmallAxis("lift", HomingKind::endstop, -1);
    parts.gpio.chip = "board";
    parts.gpio.real_time.priority = 0;
    parts.gpio.emergency_stop = {"ESTOP", false, GpioBias::as_is};
    GpioAxisWiring& turntable = parts.gpio.turntable;
    turntable.step = {"TS"};
    turntable.direction = {"TD"};
    turntable.enable = {"TE", true};
    turntable.index = {"INDEX"};
    GpioAxisWiring& lift = parts.gpio.lift;
    lift.step = {"LS"};
    lift.direction = {"LD"};
    lift.enable = {"LE", true};
    lift.endstop = {"ENDSTOP"};
    parts.aim_ids = {"a0"};
  }
  std::unique_ptr<Motion> Make() {
    auto motion = MakeGpioMotion(parts, board->Opener(), std::make_shared<RealTimeClock>());
    EXPECT_TRUE(motion) << ToString(motion.error());
    return motion ? std::move(*motion) : nullptr;
  }
  std::shared_ptr<SimGpioBoard> board = std::make_shared<SimGpioBoard>(
      "board",
      std::vector<std::string>{"TS", "TD", "TE", "LS", "LD", "LE", "INDEX", "ENDSTOP", "ESTOP",
                               "POWER", "COVER"},
      std::make_shared<SystemClock>());
  GpioMotionParts parts;
  bool level[6] = {};
  std::atomic<std::int64_t> position[6] = {-60, 0, 0, 60, 0, 0};
  std::atomic<std::int64_t> edges{0};
  std::jthread switches;
};

// What comes before a test's own question: where a busy machine brings the news of a switch too
// late, homing refuses and is asked again.
bool HomedForTheTest(Motion& motion) {
  for (int tries = 0; tries < 3; ++tries) {
    const auto homed = motion.Home({});
    if (homed) return true;
    std::cout << ToString(homed.error()) << "\n";
  }
  return false;
}

TEST(GpioMotion, StepsOnTheLinesAreThoseCounted) {
  Bench bench;
  const auto motion = bench.Make();
  ASSERT_TRUE(motion);
  const auto homed = motion->Home({});
  ASSERT_TRUE(homed) << ToString(homed.error());
  const std::int64_t turn_zero = bench.position[kTurnStep], lift_zero = bench.position[kLiftStep];
  for (const StageTarget& target :
       {StageTarget{20, 30, "a0"}, StageTarget{-5, 2, "a0"}, StageTarget{0.1, 30, "a0"}}) {
    const auto moved = motion->MoveTo(target, {});
    ASSERT_TRUE(moved) << ToString(moved.error());
    EXPECT_EQ(bench.position[kTurnStep] - turn_zero, std::llround(target.turntable_deg * 10));
    EXPECT_EQ(bench.position[kLiftStep] - lift_zero, std::llround(target.lift_mm * 10));
  }
}

TEST(GpioMotion, AnEmergencyStopCutsTheCurrentAndIsLatched) {
  Bench bench;
  const auto motion = bench.Make();
  ASSERT_TRUE(motion);
  ASSERT_TRUE(HomedForTheTest(*motion));
  std::thread presser([&] {
    const std::int64_t from = bench.edges;
    while (bench.edges - from < 100) SystemClock().SleepFor(100'000);
    bench.board->Drive("ESTOP", true);
  });
  const auto moved = motion->MoveTo({500, 0, "a0"}, {});
  presser.join();
  ASSERT_FALSE(moved);
  EXPECT_THAT(moved.error().what, HasSubstr("emergency stop"));
  EXPECT_TRUE(bench.board->Level("TE") && bench.board->Level("LE")) << "no current";
  const MotionStatus status = motion->ReadStatus();
  EXPECT_EQ(status.alarm, Alarm::invalid);
  EXPECT_THAT(status.interlocks, HasSubstr("emergency stop"));
  EXPECT_EQ(status.turntable, AxisState::fault);
  const std::int64_t edges = bench.edges;

  bench.board->Drive("ESTOP", false);
  EXPECT_THAT(ToString(motion->Home({}).error()), HasSubstr("acknowledge"));
  while (motion->ReadStatus().alarm != Alarm::none) {
    ASSERT_TRUE(motion->Acknowledge());  // nothing until the release has been seen
    SystemClock().SleepFor(100'000);
  }
  EXPECT_FALSE(motion->MoveTo({0, 0, "a0"}, {})) << "not homed";
  EXPECT_EQ(bench.edges, edges);
  bench.position[kTurnStep] = -60;
  ASSERT_TRUE(HomedForTheTest(*motion));
  EXPECT_TRUE(motion->MoveTo({1, 1, "a0"}, {}));
}

TEST(GpioMotion, PressedFromTheStartItPermitsNothing) {
  Bench bench;
  bench.board->Drive("ESTOP", true);
  const auto motion = bench.Make();
  ASSERT_TRUE(motion);
  const auto homed = motion->Home({});
  ASSERT_FALSE(homed);
  EXPECT_EQ(homed.error().kind, ErrorKind::device);
  EXPECT_EQ(bench.edges, 0);
}

// A bench whose motors' supply is read back: POWER is high while it is there.
struct PowerBench : Bench {
  PowerBench() {
    parts.gpio.motor_power = {"POWER"};
    parts.gpio.power_off_ms = 1;
    board->Drive("POWER", true);
  }
  // Until the watching threads have seen what was done to the lines.
  static void Until(Motion& motion, const std::string& interlocks) {
    while (motion.ReadStatus().interlocks != interlocks) SystemClock().SleepFor(100'000);
  }
};

TEST(GpioMotion, ASupplyThatTheEmergencyStopDoesNotCutIsAFault) {
  PowerBench bench;
  const auto motion = bench.Make();
  ASSERT_TRUE(motion);
  ASSERT_TRUE(HomedForTheTest(*motion));
  bench.board->Drive("ESTOP", true);
  PowerBench::Until(*motion, "emergency stop, motor power not cut by the emergency stop");
  EXPECT_EQ(motion->ReadStatus().alarm, Alarm::invalid);
  EXPECT_THAT(motion->ReadStatus().fault, HasSubstr("not cut"));
  bench.board->Drive("ESTOP", false);
  while (motion->ReadStatus().alarm != Alarm::none) {
    ASSERT_TRUE(motion->Acknowledge());
    SystemClock().SleepFor(100'000);
  }
  ASSERT_TRUE(HomedForTheTest(*motion));
}

TEST(GpioMotion, ASupplyThatGoesEndsTheMoveAndNeedsHoming) {
  PowerBench bench;
  const auto motion = bench.Make();
  ASSERT_TRUE(motion);
  ASSERT_TRUE(HomedForTheTest(*motion));
  std::thread unplugger([&] {
    const std::int64_t from = bench.edges;
    while (bench.edges - from < 100) SystemClock().SleepFor(100'000);
    bench.board->Drive("POWER", false);
  });
  const auto moved = motion->MoveTo({500, 0, "a0"}, {});
  unplugger.join();
  ASSERT_FALSE(moved);
  EXPECT_THAT(moved.error().what, HasSubstr("motor power off"));
  EXPECT_FALSE(motion->Home({})) << "there is no supply";
  bench.board->Drive("POWER", true);
  while (motion->ReadStatus().alarm != Alarm::none) {
    ASSERT_TRUE(motion->Acknowledge());
    SystemClock().SleepFor(100'000);
  }
  EXPECT_FALSE(motion->MoveTo({0, 0, "a0"}, {})) << "not homed";
  bench.position[kTurnStep] = -60;
  ASSERT_TRUE(HomedForTheTest(*motion));
}

TEST(GpioMotion, AnEmergencyStopThatCutsTheSupplyIsNoFaultOfItsOwn) {
  PowerBench bench;
  bench.parts.gpio.power_off_ms = 10'000;
  const auto motion = bench.Make();
  ASSERT_TRUE(motion);
  ASSERT_TRUE(HomedForTheTest(*motion));
  bench.board->Drive("ESTOP", true);
  bench.board->Drive("POWER", false);
  PowerBench::Until(*motion, "emergency stop, motor power off");
  EXPECT_EQ(motion->ReadStatus().fault, "emergency stop");
}

TEST(GpioMotion, AnOpenCoverStopsAMoveAndForbidsTheNext) {
  Bench bench;
  bench.parts.gpio.cover = {"COVER"};
  const auto motion = bench.Make();
  ASSERT_TRUE(motion);
  ASSERT_TRUE(HomedForTheTest(*motion));
  std::thread opener([&] {
    const std::int64_t from = bench.edges;
    while (bench.edges - from < 100) SystemClock().SleepFor(100'000);
    bench.board->Drive("COVER", true);
  });
  const auto moved = motion->MoveTo({500, 0, "a0"}, {});
  opener.join();
  ASSERT_FALSE(moved);
  EXPECT_THAT(moved.error().what, HasSubstr("cover open"));
  EXPECT_FALSE(motion->MoveTo({0, 0, "a0"}, {}));
  bench.board->Drive("COVER", false);
  PowerBench::Until(*motion, "");
  EXPECT_TRUE(motion->MoveTo({0, 0, "a0"}, {})) << "the position was kept";
}

TEST(GpioMotion, ALineThatIsMissingOrTakenIsNamed) {
  Bench bench;
  const auto holder = bench.board->Open({"board", "someone", {{"LS", true}}});
  const auto taken =
      MakeGpioMotion(bench.parts, bench.board->Opener(), std::make_shared<RealTimeClock>());
  ASSERT_FALSE(taken);
  EXPECT_THAT(taken.error().where, HasSubstr("LS"));
  EXPECT_THAT(taken.error().mend, HasSubstr("someone"));
  bench.parts.gpio.lift.endstop = {};
  const auto none =
      MakeGpioMotion(bench.parts, bench.board->Opener(), std::make_shared<RealTimeClock>());
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().where, HasSubstr("axis.lift.gpio.endstop"));
}

}  // namespace
}  // namespace scan
