// The laws of motion on real lines: counts, positions and states against what the motors did.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <atomic>
#include <cmath>
#include <regex>
#include <thread>

#include "drivers/base/rng.h"
#include "drivers/motion/axis_table.h"
#include "tests/lab/lab_station.h"

namespace scan {
namespace {

using ::testing::HasSubstr;

constexpr unsigned kTurntableEnable = 2, kLiftEnable = 6, kBrake = 7, kEstop = 9, kCover = 10;

class MotionLaws : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(DriveLevel(station.board, kEstop, false));
    ASSERT_TRUE(DriveLevel(station.board, kCover, false));
    motion = station.MakeMotion();
    ASSERT_TRUE(motion);
  }
  void Home() {
    const auto homed = motion->Home({});
    ASSERT_TRUE(homed) << ToString(homed.error());
    ASSERT_TRUE(station.motors->Sync());
    turntable_zero = Position("turntable");
    lift_zero = Position("lift");
  }
  std::int64_t Position(const char* motor) { return station.motors->State(motor).position; }
  std::int64_t Edges() {
    return station.motors->State("turntable").edges + station.motors->State("lift").edges;
  }
  // Where the motors should be by what the driver reports, in steps from the reference.
  void ExpectCountsEqual() {
    ASSERT_TRUE(station.motors->Sync());
    const StagePosition at = motion->ReadStatus().position;
    EXPECT_EQ(Position("turntable") - turntable_zero,
              std::llround(at.turntable_deg.counted * station.config.turntable.steps_per_unit));
    EXPECT_EQ(Position("lift") - lift_zero,
              std::llround((at.lift_mm.counted - station.config.lift.homing.position) *
                           station.config.lift.steps_per_unit));
  }
  // Waits until the motors have made `edges` more steps, then acts.
  template <class Act>
  std::thread After(std::int64_t edges, Act act) {
    return std::thread([this, from = Edges(), edges, act] {
      while (Edges() - from < edges) station.clock->SleepFor(1'000'000);
      act();
    });
  }

  LabStation station = LabStation::Make();
  std::unique_ptr<Motion> motion;
  std::int64_t turntable_zero = 0, lift_zero = 0;
};

TEST_F(MotionLaws, TwoHundredThousandStepsAreCountedAsCommanded) {
  Home();
  Rng rng(7);
  const std::int64_t before = Edges();
  double turntable_deg = 0;
  int moves = 0, stops = 0;
  while (Edges() - before < 200'000) {
    turntable_deg += rng.Uniform(-60, 60);
    const StageTarget target{turntable_deg, rng.Uniform(0, 40), "a0"};
    std::thread stopper;
    const bool stop = rng.Uniform(0, 1) < 0.3;
    if (stop) {
      stopper = After(static_cast<std::int64_t>(rng.Uniform(1, 1000)),
                      [this] { EXPECT_TRUE(motion->Stop()); });
    }
    const auto moved = motion->MoveTo(target, {});
    if (stopper.joinable()) stopper.join();
    if (moved) {
      EXPECT_EQ(std::llround(moved->position.turntable_deg.counted * 100),
                std::llround(turntable_deg * 100));
    } else {
      ASSERT_EQ(moved.error().kind, ErrorKind::cancelled) << ToString(moved.error());
      ++stops;
      turntable_deg = motion->ReadStatus().position.turntable_deg.counted;
    }
    ++moves;
    ExpectCountsEqual();
    ASSERT_FALSE(HasFailure()) << "move " << moves;
  }
  for (const char* motor : {"turntable", "lift"}) {
    EXPECT_EQ(station.motors->State(motor).idle_edges, 0) << "steps without current";
  }
  EXPECT_GT(stops, 0);
  fmt::print("figure: {} steps in {} moves, {} of them stopped on the way: all counts equal\n",
             Edges() - before, moves, stops);
}

TEST_F(MotionLaws, AfterAnAbortOnlyHomingClears) {
  Home();
  auto aborter = After(500, [this] { EXPECT_TRUE(motion->Abort()); });
  const auto moved = motion->MoveTo({40, 30, "a0"}, {});
  aborter.join();
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::device);
  ASSERT_TRUE(station.motors->Sync());
  const std::int64_t edges = Edges();
  EXPECT_FALSE(motion->MoveTo({0, 0, "a0"}, {}));
  EXPECT_TRUE(motion->Acknowledge());
  EXPECT_FALSE(motion->MoveTo({0, 0, "a0"}, {}));
  ASSERT_TRUE(station.motors->Sync());
  EXPECT_EQ(Edges(), edges);
  station.TurnBack();
  Home();
  EXPECT_TRUE(motion->MoveTo({5, 3, "a0"}, {}));
  ExpectCountsEqual();
}

TEST_F(MotionLaws, AnEmergencyStopIsLatchedUntilAcknowledgedAndHomed) {
  Home();
  auto presser = After(500, [this] { EXPECT_TRUE(DriveLevel(station.board, kEstop, true)); });
  const auto moved = motion->MoveTo({40, 30, "a0"}, {});
  presser.join();
  ASSERT_FALSE(moved);
  EXPECT_THAT(moved.error().what, HasSubstr("emergency stop"));
  MotionStatus status = motion->ReadStatus();
  EXPECT_EQ(status.turntable, AxisState::fault);
  EXPECT_EQ(status.lift, AxisState::fault);
  EXPECT_EQ(status.alarm, Alarm::invalid);
  ASSERT_TRUE(station.motors->Sync());
  EXPECT_FALSE(station.motors->State("turntable").powered);
  EXPECT_FALSE(station.motors->State("lift").powered);
  EXPECT_TRUE(ReadLevel(station.board, kBrake).value());
  const std::int64_t edges = Edges();

  EXPECT_TRUE(motion->Acknowledge());
  EXPECT_FALSE(motion->Home({})) << "it is still pressed";
  ASSERT_TRUE(DriveLevel(station.board, kEstop, false));
  while (motion->Acknowledge() && motion->ReadStatus().alarm != Alarm::none) {
    station.clock->SleepFor(1'000'000);  // until the edge has arrived
  }
  EXPECT_FALSE(motion->MoveTo({0, 0, "a0"}, {})) << "the position is unknown";
  ASSERT_TRUE(station.motors->Sync());
  EXPECT_EQ(Edges(), edges);
  station.TurnBack();
  Home();
  EXPECT_TRUE(motion->MoveTo({5, 3, "a0"}, {}));
}

TEST_F(MotionLaws, AnOpenCoverStopsAndThePositionIsKept) {
  Home();
  auto opener = After(500, [this] { EXPECT_TRUE(DriveLevel(station.board, kCover, true)); });
  const auto moved = motion->MoveTo({40, 30, "a0"}, {});
  opener.join();
  ASSERT_FALSE(moved);
  EXPECT_THAT(moved.error().what, HasSubstr("cover open"));
  ExpectCountsEqual();
  EXPECT_THAT(ToString(motion->MoveTo({0, 0, "a0"}, {}).error()), HasSubstr("cover open"));
  ASSERT_TRUE(DriveLevel(station.board, kCover, false));
  while (motion->ReadStatus().alarm != Alarm::none) station.clock->SleepFor(1'000'000);
  const auto onwards = motion->MoveTo({5, 3, "a0"}, {});
  EXPECT_TRUE(onwards) << ToString(onwards.error());
  ExpectCountsEqual();
}

// Tells how many steps the lift had made when the driver received its endstop's edge.
class Noted final : public GpioLines {
 public:
  struct Notes {
    std::atomic<std::int64_t> steps{0}, at_edge{-1};
  };
  Noted(std::unique_ptr<GpioLines> inner, GpioRequest request, Notes& notes)
      : inner_(std::move(inner)), request_(std::move(request)), notes_(notes) {}
  std::size_t size() const override { return inner_->size(); }
  Status Set(std::span<const GpioLevel> levels) override {
    if (request_.lines[0].name == "LIFT_STEP" && levels[0].active) ++notes_.steps;
    return inner_->Set(levels);
  }
  Result<bool> Get(std::size_t line) override { return inner_->Get(line); }
  Result<std::optional<GpioEdge>> WaitEdge(std::int64_t timeout_ns, int stop_fd) override {
    auto edge = inner_->WaitEdge(timeout_ns, stop_fd);
    if (edge && *edge && (*edge)->active && request_.lines[(*edge)->line].name == "LIFT_ENDSTOP") {
      notes_.at_edge = notes_.steps.load();
    }
    return edge;
  }

 private:
  std::unique_ptr<GpioLines> inner_;
  GpioRequest request_;
  Notes& notes_;
};

TEST_F(MotionLaws, ALimitSwitchAtFullSpeedStopsWithinTheRamp) {
  Noted::Notes notes;
  motion.reset();
  motion =
      station.MakeMotion([&](const GpioRequest& request) -> Result<std::unique_ptr<GpioLines>> {
        SCAN_TRY(auto lines, OpenGpiodLines(request));
        return std::make_unique<Noted>(std::move(lines), request, notes);
      });
  Home();
  ASSERT_TRUE(motion->MoveTo({0, 40, "a0"}, {}));
  // Pushed down by 20 mm: the switch comes in the middle of the way, at full speed.
  ASSERT_TRUE(station.motors->Turn("lift", -20 * 250));
  notes.at_edge = -1;
  const auto moved = motion->MoveTo({0, 0, "a0"}, {});
  ASSERT_FALSE(moved);
  EXPECT_THAT(moved.error().what, HasSubstr("limit switch"));
  EXPECT_EQ(motion->ReadStatus().lift, AxisState::fault);
  EXPECT_EQ(motion->ReadStatus().alarm, Alarm::invalid);
  ASSERT_GE(notes.at_edge.load(), 0);
  const AxisConfig& lift = station.config.lift;
  const double ramp_mm =
      (lift.velocity * lift.velocity - lift.self_start * lift.self_start) / (2 * lift.acceleration);
  // One step may be on its way when the edge is received.
  EXPECT_LE(notes.steps - notes.at_edge, std::llround(ramp_mm * lift.steps_per_unit) + 1);
  fmt::print("figure: {} step(s) after the limit switch's edge was received\n",
             notes.steps - notes.at_edge);
  EXPECT_FALSE(motion->MoveTo({0, 10, "a0"}, {}));
  station.TurnBack();
  Home();
  EXPECT_EQ(motion->ReadStatus().alarm, Alarm::none);
  EXPECT_TRUE(motion->MoveTo({0, 10, "a0"}, {}));
  motion.reset();  // before the notes
}

TEST_F(MotionLaws, ABrokenEndstopIsAClearFault) {
  const struct {
    SwitchFault fault;
    const char* words;
  } cases[] = {
      {SwitchFault::stuck_high, "stayed active"},
      {SwitchFault::disconnected, "did not come"},
      // Which of its ways shows first depends on how many edges the kernel's thread caught.
      {SwitchFault::bounces, "switch|changed more than"}};
  station.config.lift.homing.max_travel = 5;  // mm
  motion.reset();
  motion = station.MakeMotion();
  for (const auto& broken : cases) {
    station.TurnBack();
    ASSERT_TRUE(station.motors->Break("lift", broken.fault));
    station.clock->SleepFor(300'000'000);  // the edges arrive
    const auto homed = motion->Home({});
    ASSERT_FALSE(homed) << broken.words;
    EXPECT_EQ(homed.error().kind, ErrorKind::device);
    EXPECT_TRUE(std::regex_search(homed.error().what, std::regex(broken.words)))
        << homed.error().what;
    EXPECT_FALSE(homed.error().mend.empty());
    EXPECT_EQ(motion->ReadStatus().lift, AxisState::fault);
    EXPECT_FALSE(motion->MoveTo({0, 0, "a0"}, {}));
  }
  ASSERT_TRUE(station.motors->Break("lift", SwitchFault::works));
  station.TurnBack();
  Home();
}

TEST_F(MotionLaws, EveryLineIsReleasedWithItsOwner) {
  Home();
  for (const unsigned line : {kTurntableEnable, kLiftEnable}) {
    EXPECT_FALSE(ReadLevel(station.board, line).value()) << "current is on";
    ASSERT_TRUE(DriveLevel(station.board, line, true));  // the pull-up that is to be wired
  }
  motion.reset();
  ASSERT_TRUE(station.motors->Sync());
  for (const unsigned line : {kTurntableEnable, kLiftEnable}) {
    EXPECT_TRUE(ReadLevel(station.board, line).value());
  }
  EXPECT_TRUE(OpenGpiodLines({"scan-lab", "test", {{"LIFT_STEP", true}}}));
}

}  // namespace
}  // namespace scan
