#include "drivers/motion/stepper_motion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <thread>
#include <utility>

#include "drivers/base/rng.h"
#include "drivers/base/units.h"
#include "drivers/base/virtual_clock.h"
#include "drivers/motion/sim/sim_step_port.h"
#include "drivers/station/sim_world.h"
#include "drivers/station/station_config.h"

namespace scan {
namespace {

using ::testing::HasSubstr;

constexpr std::int64_t kMs = 1'000'000;

// Counts what the motor really does, beside the physics of the world.
class CountingPhysics final : public AxisPhysics {
 public:
  explicit CountingPhysics(std::shared_ptr<AxisPhysics> inner) : inner_(std::move(inner)) {}
  void OnPower(bool on) override {
    powered = on;
    inner_->OnPower(on);
  }
  void OnEdge(bool positive, std::int64_t mono_ns) override {
    steps += positive ? 1 : -1;
    ++edges;
    if (last_ns > 0) shortest_ns = std::min(shortest_ns, mono_ns - last_ns);
    last_ns = mono_ns;
    inner_->OnEdge(positive, mono_ns);
  }
  bool Endstop() const override { return inner_->Endstop(); }
  bool Index() const override { return inner_->Index(); }

  std::int64_t steps = 0, edges = 0, last_ns = 0;
  std::int64_t shortest_ns = std::numeric_limits<std::int64_t>::max();
  bool powered = false;

 private:
  std::shared_ptr<AxisPhysics> inner_;
};

// A board on the bench: what is wired to it is said in words.
struct Bench {
  explicit Bench(StationConfig with = DefaultSimStation(), StepPortFaults turntable_faults = {},
                 StepPortFaults lift_faults = {}, std::shared_ptr<Clock> use_clock = {})
      : config(std::move(with)),
        world(std::make_shared<SimWorld>(config)),
        clock(use_clock ? std::move(use_clock) : std::make_shared<VirtualClock>()),
        turntable(std::make_shared<CountingPhysics>(world->turntable())),
        lift(std::make_shared<CountingPhysics>(world->lift())) {
    StepperMotion::Parts parts;
    parts.clock = clock;
    parts.turntable = std::make_unique<Axis>(
        config.turntable, std::make_unique<SimStepPort>(turntable, "turntable", turntable_faults));
    parts.lift = std::make_unique<Axis>(config.lift,
                                        std::make_unique<SimStepPort>(lift, "lift", lift_faults));
    motion = std::make_unique<StepperMotion>(std::move(parts));
  }
  // Steps that the position the driver reports stands for, from the reference.
  std::int64_t ReportedSteps(const AxisReading& reading, const AxisConfig& axis) const {
    return std::llround((reading.counted - axis.homing.position) * axis.steps_per_unit);
  }
  void ZeroCounts() { turntable->steps = lift->steps = 0; }

  StationConfig config;
  std::shared_ptr<SimWorld> world;
  std::shared_ptr<Clock> clock;
  std::shared_ptr<CountingPhysics> turntable, lift;
  std::unique_ptr<StepperMotion> motion;
};

StationConfig StationWith(ErrorLevel level) {
  StationConfig config = DefaultSimStation();
  config.sim.errors = DefaultSimErrors(level);
  return config;
}

TEST(StepperMotion, NothingMovesBeforeHoming) {
  Bench bench;
  const auto moved = bench.motion->MoveTo({10, 10, "a0"}, {});
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::device);
  EXPECT_THAT(moved.error().mend, HasSubstr("home"));
  EXPECT_EQ(bench.turntable->edges + bench.lift->edges, 0);
}

TEST(StepperMotion, HomingFindsTheSwitchesWhereverTheAxesStand) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    StationConfig config = StationWith(ErrorLevel::static_errors);
    config.sim.seed = seed;
    Bench bench(config);
    for (int epoch = 1; epoch <= 2; ++epoch) {  // the second time the switch is near or active
      const auto homed = bench.motion->Home({});
      ASSERT_TRUE(homed) << ToString(homed.error());
      EXPECT_EQ(homed->reference_epoch, epoch);
      EXPECT_EQ(homed->position.lift_mm.counted, config.lift.homing.position);
      const TrueState truth = bench.world->StateAt("c0", bench.clock->Now().mono_ns);
      EXPECT_NEAR(truth.lift_mm, config.lift.homing.position, 1e-6);
      EXPECT_NEAR(std::remainder(truth.turntable_rad, 2 * kPi), 0, 1e-9);
    }
  }
}

TEST(StepperMotion, StepCountsEqualThoseCommandedOverRandomMoves) {
  Bench bench;
  ASSERT_TRUE(bench.motion->Home({}));
  bench.ZeroCounts();
  Rng rng(5);
  double turntable = 0;
  for (int k = 0; k < 40; ++k) {
    turntable += rng.Uniform(-60, 60);
    const double lift = rng.Uniform(0, 60);
    const auto moved = bench.motion->MoveTo({turntable, lift, "a0"}, {});
    ASSERT_TRUE(moved) << ToString(moved.error());
    const StagePosition& at = moved->position;
    EXPECT_EQ(bench.turntable->steps,
              bench.ReportedSteps(at.turntable_deg, bench.config.turntable));
    EXPECT_EQ(bench.turntable->steps, std::llround(turntable * 40));
    EXPECT_EQ(bench.lift->steps, bench.ReportedSteps(at.lift_mm, bench.config.lift));
    EXPECT_EQ(bench.lift->steps, std::llround((lift + 5) * 400));
    EXPECT_EQ(at.turntable_deg.commanded, turntable);
    // Play is always taken up from the same side.
    EXPECT_NEAR(at.turntable_deg.estimated, at.turntable_deg.counted, 1e-9);
    EXPECT_NEAR(at.lift_mm.estimated, at.lift_mm.counted, 1e-9);
    EXPECT_LE(bench.clock->Now().mono_ns, moved->settled_mono_ns);
    EXPECT_GE(moved->settled_mono_ns - std::max(bench.turntable->last_ns, bench.lift->last_ns),
              500 * kMs);
  }
  EXPECT_GE(bench.turntable->shortest_ns + 3, 1'000'000'000 / (30 * 40));
  EXPECT_GE(bench.lift->shortest_ns + 3, 1'000'000'000 / (20 * 400));
}

TEST(StepperMotion, ASignTurnsTheMotorAndNotThePosition) {
  StationConfig config = StationWith(ErrorLevel::ideal);
  config.turntable.sign = -1;
  Bench bench(config);
  ASSERT_TRUE(bench.motion->Home({}));
  bench.ZeroCounts();
  ASSERT_TRUE(bench.motion->MoveTo({10, 0, "a0"}, {}));
  EXPECT_EQ(bench.turntable->steps, -400);
  EXPECT_NEAR(bench.world->StateAt("c0", bench.clock->Now().mono_ns).turntable_rad, RadFromDeg(10),
              1e-9);
}

TEST(StepperMotion, TargetsThatCannotBeAreRefusedAndMoveNothing) {
  Bench bench;
  ASSERT_TRUE(bench.motion->Home({}));
  const StagePosition before = bench.motion->ReadStatus().position;
  const std::int64_t edges = bench.turntable->edges + bench.lift->edges;
  const double inf = std::numeric_limits<double>::infinity();
  for (const StageTarget& target :
       {StageTarget{10, -0.01, "a0"}, StageTarget{10, 200.01, "a0"}, StageTarget{inf, 10, "a0"},
        StageTarget{std::nan(""), 10, "a0"}, StageTarget{10, std::nan(""), "a0"}}) {
    const auto moved = bench.motion->MoveTo(target, {});
    ASSERT_FALSE(moved);
    EXPECT_EQ(moved.error().kind, ErrorKind::bad_input);
  }
  EXPECT_EQ(bench.turntable->edges + bench.lift->edges, edges);
  EXPECT_EQ(bench.motion->ReadStatus().position, before);
}

// Runs `during` on a second thread at `after_ms` of a move of the turntable by 300 degrees.
template <class During>
Result<MoveReport> MoveWith(Bench& bench, std::int64_t after_ms, During during) {
  auto* clock = dynamic_cast<VirtualClock*>(bench.clock.get());
  Participation part(clock);
  clock->MessageSent();
  std::thread other([&] {
    Participation other_part(clock, true);
    clock->SleepFor(after_ms * kMs);
    during();
  });
  const auto result = bench.motion->MoveTo({300, 50, "a0"}, {});
  BlockingWait joining(clock);
  other.join();
  return result;
}

TEST(StepperMotion, AfterAStopThePositionIsKnownToTheStep) {
  for (const std::int64_t after_ms : {0, 1, 3, 70, 300, 1111, 2500, 5000, 9900, 10'300}) {
    Bench bench;
    ASSERT_TRUE(bench.motion->Home({}));
    bench.ZeroCounts();
    std::int64_t stop_ns = 0;
    const auto moved = MoveWith(bench, after_ms, [&] {
      stop_ns = bench.clock->Now().mono_ns;
      EXPECT_TRUE(bench.motion->Stop());
      EXPECT_TRUE(bench.motion->Stop());  // twice is once
    });
    if (moved) continue;  // the stop came before or after the move
    EXPECT_EQ(moved.error().kind, ErrorKind::cancelled) << ToString(moved.error());
    const MotionStatus status = bench.motion->ReadStatus();
    EXPECT_EQ(bench.turntable->steps,
              bench.ReportedSteps(status.position.turntable_deg, bench.config.turntable));
    EXPECT_EQ(bench.lift->steps, bench.ReportedSteps(status.position.lift_mm, bench.config.lift));
    // At most the whole ramp: (30 - 5) deg/s at 60 deg/s2.
    EXPECT_LE(bench.turntable->last_ns - stop_ns, 450 * kMs);
    const auto onwards = bench.motion->MoveTo({20, 10, "a0"}, {});
    ASSERT_TRUE(onwards) << ToString(onwards.error());
    EXPECT_EQ(bench.turntable->steps, 800);
    EXPECT_EQ(bench.lift->steps, 6000);
    EXPECT_EQ(bench.motion->ReadStatus().reference_epoch, 1);
  }
}

TEST(StepperMotion, ALostHeartbeatEndsTheMoveAsItsRowSays) {
  Bench bench;
  ASSERT_TRUE(bench.motion->Home({}));
  bench.ZeroCounts();
  const auto moved = MoveWith(bench, 1111, [&] { EXPECT_TRUE(bench.motion->LoseHeartbeat()); });
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::device);
  EXPECT_THAT(moved.error().what, HasSubstr("heartbeat lost"));
  const MotionStatus status = bench.motion->ReadStatus();
  EXPECT_EQ(status.alarm, Alarm::major);
  EXPECT_EQ(status.interlocks, "heartbeat lost");
  EXPECT_EQ(bench.turntable->steps,
            bench.ReportedSteps(status.position.turntable_deg, bench.config.turntable));
  EXPECT_LT(bench.turntable->steps, 12'000);
  const auto refused = bench.motion->MoveTo({20, 10, "a0"}, {});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().mend, HasSubstr("acknowledge"));
  EXPECT_FALSE(bench.motion->Home({}));
  ASSERT_TRUE(bench.motion->Acknowledge());
  EXPECT_TRUE(bench.motion->MoveTo({20, 10, "a0"}, {})) << "the position stayed known";
}

TEST(StepperMotion, ARequestedTokenStopsToo) {
  Bench bench;
  ASSERT_TRUE(bench.motion->Home({}));
  const std::int64_t edges = bench.turntable->edges;
  std::stop_source stop;
  stop.request_stop();
  const auto moved = bench.motion->MoveTo({300, 50, "a0"}, stop.get_token());
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::cancelled);
  EXPECT_EQ(bench.turntable->edges, edges);
  EXPECT_FALSE(bench.motion->Home(stop.get_token()));
}

TEST(StepperMotion, AfterAnAbortThePositionIsUnknownUntilHomed) {
  Bench bench;
  ASSERT_TRUE(bench.motion->Home({}));
  std::int64_t abort_ns = 0;
  const auto moved = MoveWith(bench, 1500, [&] {
    abort_ns = bench.clock->Now().mono_ns;
    EXPECT_TRUE(bench.motion->Abort());
  });
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::device);
  EXPECT_LE(bench.turntable->last_ns, abort_ns);  // no ramp
  EXPECT_EQ(bench.motion->ReadStatus().turntable, AxisState::unreferenced);
  EXPECT_FALSE(bench.motion->MoveTo({0, 0, "a0"}, {}));
  const auto homed = bench.motion->Home({});
  ASSERT_TRUE(homed) << ToString(homed.error());
  EXPECT_EQ(homed->reference_epoch, 2);
  EXPECT_TRUE(bench.motion->MoveTo({5, 5, "a0"}, {}));
}

TEST(StepperMotion, AnAbortAtRestForgetsThePosition) {
  Bench bench;
  ASSERT_TRUE(bench.motion->Home({}));
  ASSERT_TRUE(bench.motion->Abort());
  EXPECT_FALSE(bench.motion->MoveTo({1, 1, "a0"}, {}));
}

TEST(StepperMotion, AStopDuringHomingLeavesThePositionUnknown) {
  Bench bench;
  auto* clock = dynamic_cast<VirtualClock*>(bench.clock.get());
  Participation part(clock);
  clock->MessageSent();
  std::thread other([&] {
    Participation other_part(clock, true);
    clock->SleepFor(400 * kMs);
    (void)bench.motion->Stop();
  });
  const auto homed = bench.motion->Home({});
  {
    BlockingWait joining(clock);
    other.join();
  }
  ASSERT_FALSE(homed);
  EXPECT_EQ(homed.error().kind, ErrorKind::cancelled);
  EXPECT_EQ(bench.motion->ReadStatus().lift, AxisState::unreferenced);
  EXPECT_TRUE(bench.motion->Home({}));
}

TEST(StepperMotion, AHomeSwitchThatIsStuckOrDisconnectedIsAFault) {
  using Switch = StepPortFaults::Switch;
  for (const Switch broken : {Switch::stuck_active, Switch::disconnected}) {
    Bench bench(DefaultSimStation(), {}, {broken, 0});
    const auto homed = bench.motion->Home({});
    ASSERT_FALSE(homed);
    EXPECT_EQ(homed.error().kind, ErrorKind::device);
    EXPECT_THAT(homed.error().what,
                HasSubstr(broken == Switch::disconnected ? "did not come" : "stayed active"));
    EXPECT_EQ(bench.motion->ReadStatus().lift, AxisState::fault);
    EXPECT_FALSE(bench.motion->ReadStatus().fault.empty());
    EXPECT_FALSE(bench.motion->MoveTo({1, 1, "a0"}, {}));
  }
}

TEST(StepperMotion, EveryFailingEdgeIsAFaultAndNeverAWrongPosition) {
  for (std::int64_t nth = 1; nth < 40'000; nth = nth * 3 + 1) {
    Bench bench(DefaultSimStation(), {StepPortFaults::Switch::works, nth});
    const auto homed = bench.motion->Home({});
    const auto moved = homed ? bench.motion->MoveTo({90, 5, "a0"}, {}) : Result<MoveReport>();
    if (homed && moved) continue;
    EXPECT_EQ((homed ? moved.error() : homed.error()).kind, ErrorKind::device);
    EXPECT_FALSE(bench.motion->MoveTo({1, 1, "a0"}, {}));
    ASSERT_TRUE(bench.motion->Home({}));  // the line works again
    EXPECT_TRUE(bench.motion->MoveTo({1, 1, "a0"}, {}));
  }
}

// Does something before an edge, which may fail it.
class HookedPort final : public StepPort {
 public:
  HookedPort(std::shared_ptr<AxisPhysics> physics, std::function<Status()> before_edge)
      : inner_(std::move(physics), "hooked"), before_edge_(std::move(before_edge)) {}
  Status Enable(bool on) override { return inner_.Enable(on); }
  Status Brake(bool on) override { return inner_.Brake(on); }
  Status SetDirection(bool positive) override { return inner_.SetDirection(positive); }
  Status EmitEdge(std::int64_t deadline_ns) override {
    SCAN_CHECK(before_edge_());
    return inner_.EmitEdge(deadline_ns);
  }
  Result<bool> Endstop() override { return inner_.Endstop(); }
  Result<bool> Index() override { return inner_.Index(); }

 private:
  SimStepPort inner_;
  std::function<Status()> before_edge_;
};

TEST(StepperMotion, AnEmergencyStopBesideAnotherFaultStillCutsThePower) {
  Bench bench;
  std::thread presser;
  const auto press_and_fail = [&]() -> Status {
    std::atomic<bool> pressing = false;
    presser = std::thread([&] {
      pressing = true;  // then waits for the lock that the stepping thread holds
      bench.motion->SetInterlock(Interlock::emergency_stop, true);
    });
    while (!pressing) std::this_thread::yield();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return DeviceFault("the line is gone", "hooked", "home the stage");
  };
  bool armed = false;
  StepperMotion::Parts parts;
  parts.clock = bench.clock;
  parts.turntable = std::make_unique<Axis>(
      bench.config.turntable, std::make_unique<HookedPort>(bench.turntable, [&]() -> Status {
        return std::exchange(armed, false) ? press_and_fail() : Status();
      }));
  parts.lift =
      std::make_unique<Axis>(bench.config.lift, std::make_unique<SimStepPort>(bench.lift, "lift"));
  bench.motion = std::make_unique<StepperMotion>(std::move(parts));
  for (const bool homing : {false, true}) {
    ASSERT_TRUE(bench.motion->Home({}));
    armed = true;
    const bool done =
        homing ? bool(bench.motion->Home({})) : bool(bench.motion->MoveTo({90, 0, "a0"}, {}));
    presser.join();
    EXPECT_FALSE(done);
    EXPECT_FALSE(bench.turntable->powered) << homing;
    EXPECT_FALSE(bench.lift->powered) << homing;
    EXPECT_THAT(bench.motion->ReadStatus().fault, HasSubstr("emergency stop"));
    bench.motion->SetInterlock(Interlock::emergency_stop, false);
    ASSERT_TRUE(bench.motion->Acknowledge());
  }
}

TEST(StepperMotion, RunningOntoTheEndstopStopsInsideTheRampAndFaults) {
  StationConfig config = DefaultSimStation();
  Bench bench(config);
  ASSERT_TRUE(bench.motion->Home({}));
  ASSERT_TRUE(bench.motion->MoveTo({0, 60, "a0"}, {}));
  bench.world->LoseSteps("lift", 30 * 400);
  ASSERT_TRUE(bench.motion->MoveTo({0, 95, "a0"}, {}));  // is 30 mm lower than it believes
  bench.ZeroCounts();
  const auto moved = bench.motion->MoveTo({0, 0, "a0"}, {});
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::device);
  EXPECT_THAT(moved.error().what, HasSubstr("limit switch"));
  const double ramp_mm = (20.0 * 20 - 2 * 2) / (2 * 80);
  const double true_mm = bench.world->StateAt("c0", bench.clock->Now().mono_ns).lift_mm;
  EXPECT_LT(true_mm, config.lift.homing.position);
  EXPECT_GT(true_mm, config.lift.homing.position - ramp_mm - 0.1);
  EXPECT_EQ(bench.motion->ReadStatus().lift, AxisState::fault);
  ASSERT_TRUE(bench.motion->Home({}));
  EXPECT_TRUE(bench.motion->MoveTo({0, 95, "a0"}, {}));
}

TEST(StepperMotion, OnStopSaysWhatHoldsTheAxis) {
  for (const OnStop on_stop : {OnStop::release, OnStop::hold, OnStop::brake}) {
    StationConfig config = DefaultSimStation();
    config.turntable.on_stop = on_stop;
    Bench bench(config);
    ASSERT_TRUE(bench.motion->Home({}));
    const auto moved = MoveWith(bench, 1500, [&] { (void)bench.motion->Stop(); });
    ASSERT_FALSE(moved);
    const AxisState expected = on_stop == OnStop::release ? AxisState::unpowered : AxisState::held;
    EXPECT_EQ(bench.motion->ReadStatus().turntable, expected);
    EXPECT_EQ(bench.turntable->powered, on_stop != OnStop::release);
    EXPECT_EQ(bench.motion->MoveTo({0, 0, "a0"}, {}).has_value(), on_stop != OnStop::release);
  }
}

// Wakes one sleeper late, once, when the deadline of its choice comes.
class LateClock final : public Clock {
 public:
  LateClock(std::int64_t late_ns, std::function<bool(std::int64_t)> at)
      : late_ns_(late_ns), at_(std::move(at)) {}
  Timestamp Now() override { return inner_.Now(); }
  bool SleepUntil(std::int64_t mono_ns, std::stop_token stop) override {
    const bool late = armed && mono_ns > inner_.Now().mono_ns && at_(mono_ns);
    if (late) armed = false;
    return inner_.SleepUntil(late ? mono_ns + late_ns_ : mono_ns, stop);
  }
  bool armed = false;

 private:
  VirtualClock inner_;
  std::int64_t late_ns_;
  std::function<bool(std::int64_t)> at_;
};

TEST(StepperMotion, ALateStepBelowTheSelfStartingRateShiftsTheRest) {
  auto clock = std::make_shared<LateClock>(50 * kMs, [](std::int64_t) { return true; });
  Bench bench(DefaultSimStation(), {}, {}, clock);
  ASSERT_TRUE(bench.motion->Home({}));
  bench.ZeroCounts();
  bench.turntable->shortest_ns = std::numeric_limits<std::int64_t>::max();
  clock->armed = true;  // the very first step
  const auto moved = bench.motion->MoveTo({90, -0.0, "a0"}, {});
  ASSERT_TRUE(moved) << ToString(moved.error());
  EXPECT_EQ(bench.turntable->steps, 3600);
  EXPECT_GE(bench.turntable->shortest_ns + 3, 1'000'000'000 / (30 * 40));  // no burst
}

TEST(StepperMotion, ALateStepAtSpeedIsAFault) {
  int sleeps = 0;
  auto clock = std::make_shared<LateClock>(5 * kMs, [&](std::int64_t) { return ++sleeps > 1500; });
  Bench bench(DefaultSimStation(), {}, {}, clock);
  ASSERT_TRUE(bench.motion->Home({}));
  ASSERT_TRUE(bench.motion->MoveTo({0, 0, "a0"}, {}));
  clock->armed = true;
  const auto moved = bench.motion->MoveTo({90, 0, "a0"}, {});
  ASSERT_FALSE(moved);
  EXPECT_THAT(moved.error().what, HasSubstr("late"));
  EXPECT_EQ(bench.motion->ReadStatus().turntable, AxisState::fault);
}

TEST(StepperMotion, WithoutCompensationTheEstimateFollowsThePlay) {
  // A stop on the way down: the carriage hangs one backlash above what is counted.
  StationConfig config = StationWith(ErrorLevel::static_errors);
  config.sim.errors.lift_scale_rel = 0;
  Bench bench(config);
  ASSERT_TRUE(bench.motion->Home({}));
  ASSERT_TRUE(bench.motion->MoveTo({0, 150, "a0"}, {}));
  auto* clock = dynamic_cast<VirtualClock*>(bench.clock.get());
  Participation part(clock);
  clock->MessageSent();
  std::thread other([&] {
    Participation other_part(clock, true);
    clock->SleepFor(2000 * kMs);
    (void)bench.motion->Stop();
  });
  EXPECT_FALSE(bench.motion->MoveTo({0, 50, "a0"}, {}));
  {
    BlockingWait joining(clock);
    other.join();
  }
  const AxisReading at = bench.motion->ReadStatus().position.lift_mm;
  EXPECT_NEAR(at.estimated - at.counted, 0.05, 1e-9);
  EXPECT_NEAR(bench.world->StateAt("c0", clock->Now().mono_ns).lift_mm, at.estimated, 1e-6);
}

}  // namespace
}  // namespace scan
