#include "drivers/motion/tic/tic_motion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "tests/support/tic_bench.h"

namespace scan {
namespace {

using ::testing::HasSubstr;

TEST(TicMotion, TheMotorsStandWhereTheReportsSay) {
  TicBench bench;
  const auto motion = bench.Make();
  ASSERT_TRUE(motion);
  EXPECT_FALSE(bench.turntable->energized()) << "no current before homing";
  const auto homed = motion->Home({});
  ASSERT_TRUE(homed) << ToString(homed.error());
  EXPECT_EQ(bench.turntable->place(), 1) << "just out of the switch";
  EXPECT_EQ(bench.lift->place(), 1);
  for (const StageTarget& target : {StageTarget{30, 12.5, "a0"}, StageTarget{330, 0, "a0"},
                                    StageTarget{0.025, 0.05, "a0"}, StageTarget{90, 200, "a0"}}) {
    const auto moved = motion->MoveTo(target, {});
    ASSERT_TRUE(moved) << ToString(moved.error());
    EXPECT_EQ(TicBench::UnitsOf(*bench.turntable), target.turntable_deg);
    EXPECT_EQ(TicBench::UnitsOf(*bench.lift), target.lift_mm);
    EXPECT_EQ(moved->position.turntable_deg.counted, target.turntable_deg);
    EXPECT_EQ(moved->position.lift_mm.counted, target.lift_mm);
  }
}

TEST(TicMotion, BacklashIsTakenUpFromOneSide) {
  TicBench bench;
  bench.parts.lift.backlash = 0.5;
  bench.parts.lift.min = 1;
  const auto motion = bench.Make();
  ASSERT_TRUE(motion);
  ASSERT_TRUE(motion->Home({}));
  ASSERT_TRUE(motion->MoveTo({0, 50, "a0"}, {}));
  const std::int64_t writes = bench.bus->transfers();
  const auto moved = motion->MoveTo({0, 20, "a0"}, {});
  ASSERT_TRUE(moved) << ToString(moved.error());
  EXPECT_GT(bench.bus->transfers(), writes);
  EXPECT_DOUBLE_EQ(moved->position.lift_mm.counted, 20);
  EXPECT_DOUBLE_EQ(moved->position.lift_mm.estimated, 20) << "the play is on the other side";
}

TEST(TicMotion, BackwardAxesAndForwardHomingWork) {
  TicBench bench;
  bench.parts.lift.sign = -1;  // the switch lies at the axis' positive end now
  bench.parts.lift.homing.direction = 1;
  bench.parts.lift.homing.position = 300;
  const auto motion = bench.Make();
  ASSERT_TRUE(motion);
  ASSERT_TRUE(motion->Home({}));
  EXPECT_EQ(bench.lift->place(), 1);
  ASSERT_TRUE(motion->MoveTo({0, 290, "a0"}, {}));
  EXPECT_EQ(bench.lift->place(), 401);
  bench.parts.lift.sign = 1;
  const auto unwired = TicMotion::Make(bench.parts, bench.bus, bench.clock);
  ASSERT_FALSE(unwired);
}

TEST(TicMotion, SettingsAreWrittenOnceAndOnlyWhereTheyDiffer) {
  TicBench bench;
  (void)bench.Make();
  const TicSettings settings = bench.lift->settings();
  EXPECT_EQ(settings.homing_speed_towards, 30U * 40 * 10'000);
  EXPECT_EQ(settings.homing_speed_away, 2U * 40 * 10'000);
  EXPECT_EQ(settings.command_timeout_ms, 1000);
  const int written = bench.lift->settings_written();
  EXPECT_GT(written, 0);
  EXPECT_LE(written, 8);
  (void)bench.Make();
  EXPECT_EQ(bench.lift->settings_written(), written);
}

TEST(TicMotion, WhatOnlyPololusToolCanSetIsNamed) {
  const auto refused = [](auto change) {
    TicBench bench;
    SimTic::Options options;
    options.clock = bench.clock;
    options.settings.reverse_limit_pins = 1;
    UsbIdentity identity = TicBench::Board("1-2.4", "L1");
    change(bench, options, identity);
    bench.bus->Plug(identity, std::make_shared<SimTic>(options));
    const auto made = TicMotion::Make(bench.parts, bench.bus, bench.clock);
    EXPECT_FALSE(made);
    return made ? std::string() : ToString(made.error());
  };
  using Options = SimTic::Options;
  EXPECT_THAT(refused([](auto&, Options& o, auto&) { o.settings.control_mode = 2; }),
              HasSubstr("control mode"));
  EXPECT_THAT(refused([](auto&, Options& o, auto&) { o.settings.reverse_limit_pins = 0; }),
              HasSubstr("Limit switch reverse"));
  EXPECT_THAT(refused([](auto&, Options& o, auto&) { o.keeps_settings = false; }),
              HasSubstr("did not keep"));
  EXPECT_THAT(refused([](auto&, auto&, UsbIdentity& id) { id.release = 0x0105; }),
              HasSubstr("firmware 1.05"));
  EXPECT_THAT(refused([](TicBench& b, auto&, auto&) { b.parts.tic.lift.microsteps = 64; }),
              HasSubstr("does not make 64 microsteps"));
  EXPECT_THAT(refused([](auto&, auto&, UsbIdentity& id) { id.product = 0x0089; }),
              HasSubstr("no Tic board"));
  EXPECT_THAT(refused([](TicBench& b, auto&, auto&) { b.parts.tic.lift.port = "1-2.3"; }),
              HasSubstr("same board"));
}

TEST(TicMotion, AStopRampsDownAndOnStopSaysWhatHoldsTheAxis) {
  TicBench bench;
  bench.parts.turntable.on_stop = OnStop::release;
  const auto motion = bench.Make();
  ASSERT_TRUE(motion);
  ASSERT_TRUE(motion->Home({}));
  Participation part(dynamic_cast<Activity*>(bench.clock.get()));
  auto* activity = dynamic_cast<Activity*>(bench.clock.get());
  activity->MessageSent();
  std::thread stopper([&] {
    Participation own(activity, true);
    bench.clock->SleepFor(1'000'000'000);
    EXPECT_TRUE(motion->Stop());
  });
  const auto moved = motion->MoveTo({300, 300, "a0"}, {});
  {
    BlockingWait joining(activity);
    stopper.join();
  }
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::cancelled);
  const MotionStatus status = motion->ReadStatus();
  EXPECT_EQ(status.lift, AxisState::held);
  EXPECT_EQ(status.turntable, AxisState::unpowered);
  EXPECT_FALSE(bench.turntable->energized());
  EXPECT_TRUE(bench.lift->energized());
  EXPECT_EQ(status.position.lift_mm.counted, TicBench::UnitsOf(*bench.lift)) << "to the step";
  // 1 s at 60 mm/s, 7.5 mm of ramps: had it halted or gone on, it would stand elsewhere.
  EXPECT_NEAR(status.position.lift_mm.counted, 60, 4);
  EXPECT_FALSE(motion->MoveTo({0, 0, "a0"}, {})) << "the turntable has lost its position";
  ASSERT_TRUE(motion->Home({}));
  EXPECT_TRUE(motion->MoveTo({10, 10, "a0"}, {}));
}

TEST(TicMotion, AnAbortHaltsAtOnceAlsoInHoming) {
  for (const bool homing : {false, true}) {
    TicBench bench;
    const auto motion = bench.Make();
    ASSERT_TRUE(motion);
    ASSERT_TRUE(motion->Home({}));
    ASSERT_TRUE(motion->MoveTo({40, 40, "a0"}, {}));
    auto* activity = dynamic_cast<Activity*>(bench.clock.get());
    Participation part(activity);
    activity->MessageSent();
    double at = 0;
    std::thread aborter([&] {
      Participation own(activity, true);
      bench.clock->SleepFor(500'000'000);
      EXPECT_TRUE(motion->Abort());
      at = TicBench::UnitsOf(*bench.lift);
    });
    const Status ended = homing ? Status(motion->Home({}).map([](auto&&) {}))
                                : Status(motion->MoveTo({300, 300, "a0"}, {}).map([](auto&&) {}));
    {
      BlockingWait joining(activity);
      aborter.join();
    }
    ASSERT_FALSE(ended);
    EXPECT_THAT(ended.error().what, HasSubstr("aborted"));
    EXPECT_EQ(motion->ReadStatus().lift, AxisState::unreferenced);
    EXPECT_EQ(TicBench::UnitsOf(*bench.lift), at);
    EXPECT_GT(at, 0) << "before the switch";
    EXPECT_FALSE(motion->MoveTo({1, 1, "a0"}, {}));
    ASSERT_TRUE(motion->Home({}));
    EXPECT_TRUE(motion->MoveTo({1, 1, "a0"}, {}));
  }
}

TEST(TicMotion, AnIdleBoardTimesOutHarmlesslyAndMovesOn) {
  TicBench bench;
  const auto motion = bench.Make();
  ASSERT_TRUE(motion);
  ASSERT_TRUE(motion->Home({}));
  ASSERT_TRUE(motion->MoveTo({50, 50, "a0"}, {}));
  bench.clock->SleepFor(60'000'000'000);
  const auto moved = motion->MoveTo({20, 20, "a0"}, {});
  ASSERT_TRUE(moved) << ToString(moved.error());
  EXPECT_EQ(TicBench::UnitsOf(*bench.turntable), 20);
}

TEST(TicMotion, TheBoardsAreLeftAsTheirAxesNeedIt) {
  TicBench bench;
  bench.parts.turntable.on_stop = OnStop::release;
  {
    const auto motion = bench.Make();
    ASSERT_TRUE(motion);
    ASSERT_TRUE(motion->Home({}));
  }
  EXPECT_FALSE(bench.turntable->energized());
  EXPECT_TRUE(bench.lift->energized()) << "it would fall";
}

TEST(TicMotion, TheKeepAliveThreadNoticesWhatHappensAtRest) {
  TicBench bench(std::make_shared<SystemClock>());
  const auto made = MakeTicMotion(bench.parts, bench.bus, bench.clock);
  ASSERT_TRUE(made);
  bench.lift->PressKillSwitch(true);
  SystemClock clock;
  while ((*made)->ReadStatus().alarm != Alarm::invalid) clock.SleepFor(1'000'000);
  EXPECT_THAT((*made)->ReadStatus().interlocks, HasSubstr("emergency stop"));
}

}  // namespace
}  // namespace scan
