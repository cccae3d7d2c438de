// What goes wrong on the way: every transfer, the bus, the boards' own errors, switches.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <thread>

#include "drivers/motion/tic/tic_motion.h"
#include "tests/support/tic_bench.h"

namespace scan {
namespace {

using ::testing::HasSubstr;

// Runs `during` half a second into a move to (300, 300); gives the move's result.
Result<MoveReport> MoveWith(TicBench& bench, TicMotion& motion,
                            const std::function<void()>& during) {
  auto* activity = dynamic_cast<Activity*>(bench.clock.get());
  Participation part(activity);
  activity->MessageSent();
  std::thread other([&] {
    Participation own(activity, true);
    bench.clock->SleepFor(500'000'000);
    during();
  });
  auto moved = motion.MoveTo({300, 300, "a0"}, {});
  BlockingWait joining(activity);
  other.join();
  return moved;
}

TEST(TicFaults, EveryTransferMayFailOnceAndHomingMends) {
  for (const bool unplugs : {false, true}) {
    std::int64_t nth = 1;
    for (;; ++nth) {
      TicBench bench;
      bench.parts.tic.poll_ms = 40;
      bench.parts.turntable.homing.fast = bench.parts.lift.homing.fast = 60;
      bench.parts.turntable.homing.slow = bench.parts.lift.homing.slow = 5;
      bench.bus->FailAt(nth, unplugs);
      auto made = TicMotion::Make(bench.parts, bench.bus, bench.clock);
      Status done = made ? Status() : Status(tl::unexpected(made.error()));
      if (done) done = (*made)->Home({}).map([](auto&&) {});
      if (done) done = (*made)->MoveTo({20, 10, "a0"}, {}).map([](auto&&) {});
      if (bench.bus->transfers() < nth) break;
      if (done) continue;  // it failed at rest: the homing has mended it already
      EXPECT_EQ(done.error().kind, ErrorKind::device) << nth;
      EXPECT_FALSE(done.error().mend.empty()) << nth;
      bench.bus->FailAt(0);
      if (!made) continue;
      const auto refused = (*made)->MoveTo({5, 5, "a0"}, {});
      EXPECT_FALSE(refused) << nth << ": the position is unknown";
      if (unplugs) {
        const auto homed = (*made)->Home({});
        ASSERT_FALSE(homed);
        EXPECT_THAT(ToString(homed.error()), HasSubstr("plug it in")) << nth;
        bench.bus->Plug(TicBench::Board("1-2.3", "T1"), bench.turntable);
        bench.bus->Plug(TicBench::Board("1-2.4", "L1"), bench.lift);
        // A board whose handle went with the plug says so once more.
        (void)(*made)->Home({});
      }
      const auto homed = (*made)->Home({});
      ASSERT_TRUE(homed) << nth << ": " << ToString(homed.error());
      const auto moved = (*made)->MoveTo({5, 6, "a0"}, {});
      ASSERT_TRUE(moved) << nth << ": " << ToString(moved.error());
      EXPECT_EQ(TicBench::UnitsOf(*bench.turntable), 5) << nth;
      EXPECT_EQ(TicBench::UnitsOf(*bench.lift), 6) << nth;
    }
    EXPECT_GT(nth, 80);
  }
}

TEST(TicFaults, ABoardThatIsUnpluggedInMidMoveIsAFaultAndBothStop) {
  TicBench bench;
  const auto motion = bench.Make();
  ASSERT_TRUE(motion);
  ASSERT_TRUE(motion->Home({}));
  const auto moved = MoveWith(bench, *motion, [&] { bench.bus->Unplug("1-2.3"); });
  ASSERT_FALSE(moved);
  EXPECT_THAT(moved.error().mend, HasSubstr("plug it in"));
  const MotionStatus status = motion->ReadStatus();
  EXPECT_EQ(status.turntable, AxisState::fault);
  EXPECT_EQ(status.lift, AxisState::unreferenced) << "halted";
  EXPECT_FALSE(status.fault.empty());
  const std::int64_t lift = bench.lift->place();
  bench.clock->SleepFor(3'000'000'000);
  bench.bus->Plug(TicBench::Board("1-2.3", "T1"), bench.turntable);
  EXPECT_EQ(bench.lift->place(), lift);
  const std::int64_t turntable = bench.turntable->place();
  bench.clock->SleepFor(3'000'000'000);
  EXPECT_EQ(bench.turntable->place(), turntable) << "its command timeout stopped it";
  EXPECT_LT(turntable, 300 * 40);
  ASSERT_TRUE(motion->Home({}));
  EXPECT_TRUE(motion->MoveTo({1, 1, "a0"}, {}));
}

TEST(TicFaults, AnotherBoardAtThePortIsNotTaken) {
  TicBench bench;
  const auto motion = bench.Make();
  ASSERT_TRUE(motion);
  ASSERT_TRUE(motion->Home({}));
  bench.bus->Unplug("1-2.3");
  SimTic::Options options;
  options.clock = bench.clock;
  const auto stranger = std::make_shared<SimTic>(options);
  bench.bus->Plug(TicBench::Board("1-2.3", "X9"), stranger);
  EXPECT_FALSE(motion->MoveTo({10, 10, "a0"}, {}));
  const auto homed = motion->Home({});
  ASSERT_FALSE(homed);
  EXPECT_THAT(ToString(homed.error()), HasSubstr("serial X9"));
  EXPECT_EQ(stranger->place(), 0);
  EXPECT_EQ(stranger->settings_written(), 0);
}

TEST(TicFaults, TheBoardsOwnErrorsEndAMoveInTheirWords) {
  const struct {
    const char* words;
    std::function<void(SimTic&)> cause, gone;
  } cases[] = {
      {"low VIN", [](SimTic& tic) { tic.SupplyMotor(false); },
       [](SimTic& tic) { tic.SupplyMotor(true); }},
      {"motor driver error", [](SimTic& tic) { tic.OverheatDriver(); }, [](SimTic&) {}},
      {"lost its position", [](SimTic& tic) { tic.PowerCycle(); }, [](SimTic&) {}},
      {"did not arrive",
       [](SimTic& tic) { tic.Write(EncodeTic(TicCommand::set_target_position, 0), {}); },
       [](SimTic&) {}},
  };
  for (const auto& one : cases) {
    TicBench bench;
    const auto motion = bench.Make();
    ASSERT_TRUE(motion);
    ASSERT_TRUE(motion->Home({}));
    const auto moved = MoveWith(bench, *motion, [&] { one.cause(*bench.lift); });
    ASSERT_FALSE(moved) << one.words;
    if (std::string_view(one.words) != "lost its position") {
      EXPECT_THAT(moved.error().what, HasSubstr(one.words));
    }
    EXPECT_EQ(motion->ReadStatus().lift, AxisState::fault) << one.words;
    EXPECT_FALSE(motion->MoveTo({1, 1, "a0"}, {})) << one.words;
    one.gone(*bench.lift);
    const auto homed = motion->Home({});
    ASSERT_TRUE(homed) << one.words << ": " << ToString(homed.error());
    EXPECT_TRUE(motion->MoveTo({1, 1, "a0"}, {})) << one.words;
  }
}

TEST(TicFaults, ABoardThatStartsAnewAtRestHasLostItsPosition) {
  TicBench bench;
  const auto motion = bench.Make();
  ASSERT_TRUE(motion);
  ASSERT_TRUE(motion->Home({}));
  ASSERT_TRUE(motion->MoveTo({10, 10, "a0"}, {}));
  bench.turntable->PowerCycle();
  motion->KeepAlive();
  EXPECT_EQ(motion->ReadStatus().turntable, AxisState::fault);
  EXPECT_THAT(motion->ReadStatus().fault, HasSubstr("lost its position"));
  EXPECT_EQ(motion->ReadStatus().lift, AxisState::idle);
  EXPECT_FALSE(motion->MoveTo({10, 10, "a0"}, {}));
  ASSERT_TRUE(motion->Home({}));
  EXPECT_TRUE(motion->MoveTo({10, 10, "a0"}, {}));
}

TEST(TicFaults, AMotorWithoutSupplyDoesNotHome) {
  TicBench bench;
  const auto motion = bench.Make();
  ASSERT_TRUE(motion);
  bench.lift->SupplyMotor(false);
  const auto homed = motion->Home({});
  ASSERT_FALSE(homed);
  EXPECT_THAT(homed.error().what, HasSubstr("does not get ready: low VIN"));
  EXPECT_THAT(homed.error().mend, HasSubstr("supply"));
  bench.lift->SupplyMotor(true);
  EXPECT_TRUE(motion->Home({}));
}

TEST(TicFaults, AKillSwitchCutsThePowerOfBothAndIsLatched) {
  for (const bool moving : {true, false}) {
    TicBench bench;
    const auto motion = bench.Make();
    ASSERT_TRUE(motion);
    ASSERT_TRUE(motion->Home({}));
    if (moving) {
      const auto moved = MoveWith(bench, *motion, [&] { bench.lift->PressKillSwitch(true); });
      ASSERT_FALSE(moved);
      EXPECT_THAT(moved.error().what, HasSubstr("emergency stop"));
    } else {
      bench.lift->PressKillSwitch(true);
      motion->KeepAlive();
    }
    EXPECT_FALSE(bench.lift->energized());
    EXPECT_FALSE(bench.turntable->energized());
    EXPECT_EQ(motion->ReadStatus().alarm, Alarm::invalid);
    EXPECT_FALSE(motion->Home({})) << "still pressed";
    bench.lift->PressKillSwitch(false);
    EXPECT_THAT(ToString(motion->Home({}).error()), HasSubstr("acknowledge"));
    ASSERT_TRUE(motion->Acknowledge());
    EXPECT_FALSE(motion->MoveTo({0, 0, "a0"}, {})) << "not homed";
    const auto homed = motion->Home({});
    ASSERT_TRUE(homed) << ToString(homed.error());
    EXPECT_TRUE(motion->MoveTo({1, 1, "a0"}, {}));
  }
}

TEST(TicFaults, ALimitSwitchInAMoveIsAFault) {
  TicBench bench;
  const auto motion = bench.Make();
  ASSERT_TRUE(motion);
  ASSERT_TRUE(motion->Home({}));
  ASSERT_TRUE(motion->MoveTo({100, 100, "a0"}, {}));
  bench.lift->ForceLimits(true);
  const auto moved = motion->MoveTo({100, 50, "a0"}, {});
  ASSERT_FALSE(moved);
  EXPECT_THAT(moved.error().what, HasSubstr("limit switch"));
  EXPECT_THAT(motion->ReadStatus().interlocks, HasSubstr("limit switch"));
  EXPECT_EQ(bench.lift->place(), 100 * 40 + 1) << "the board itself does not move into it";
  bench.lift->ForceLimits({});
  EXPECT_FALSE(motion->MoveTo({100, 100, "a0"}, {}));
  ASSERT_TRUE(motion->Home({}));
  EXPECT_EQ(motion->ReadStatus().alarm, Alarm::none);
}

TEST(TicFaults, AHomeSwitchThatIsStuckOrDisconnectedIsAFault) {
  for (const bool active : {true, false}) {
    TicBench bench;
    const auto motion = bench.Make();
    ASSERT_TRUE(motion);
    bench.lift->ForceLimits(active);
    const auto homed = motion->Home({});
    ASSERT_FALSE(homed);
    EXPECT_THAT(homed.error().what, HasSubstr(active ? "stayed active" : "did not come"));
    EXPECT_EQ(motion->ReadStatus().lift, AxisState::fault);
    EXPECT_EQ(motion->ReadStatus().turntable, AxisState::unpowered);
    const std::int64_t place = bench.lift->place();
    bench.clock->SleepFor(500'000'000);
    EXPECT_EQ(bench.lift->place(), place) << "it has halted";
  }
}

TEST(TicFaults, InterlocksEndAMoveAsTheirRowsSay) {
  for (const Interlock interlock : {Interlock::cover_open, Interlock::heartbeat_lost,
                                    Interlock::late_step, Interlock::emergency_stop}) {
    TicBench bench;
    const auto motion = bench.Make();
    ASSERT_TRUE(motion);
    ASSERT_TRUE(motion->Home({}));
    const auto moved = MoveWith(bench, *motion, [&] { motion->SetInterlock(interlock, true); });
    ASSERT_FALSE(moved);
    EXPECT_EQ(moved.error().kind, ErrorKind::device);
    const MotionEnd end = Row(interlock).ends_motion;
    const AxisState expected = end == MotionEnd::stop    ? AxisState::held
                               : end == MotionEnd::abort ? AxisState::unreferenced
                                                         : AxisState::fault;
    EXPECT_EQ(motion->ReadStatus().lift, expected) << Row(interlock).name;
    motion->SetInterlock(interlock, false);
    ASSERT_TRUE(motion->Acknowledge());
    if (expected != AxisState::held) {
      ASSERT_TRUE(motion->Home({}));
    }
    EXPECT_TRUE(motion->MoveTo({1, 1, "a0"}, {})) << Row(interlock).name;
  }
}

}  // namespace
}  // namespace scan
