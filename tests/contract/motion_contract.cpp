#include <cmath>
#include <limits>
#include <thread>

#include "tests/contract/twin.h"

namespace scan {
namespace {

constexpr double kStepDeg = 0.1, kStepMm = 0.1;  // no twin's steps are coarser

TEST_P(MotionContract, AMoveBeforeHomingIsRefused) {
  const auto moved = device().MoveTo({10, 5, "a0"}, {});
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::device);
  EXPECT_EQ(device().ReadStatus().reference_epoch, 0);
}

TEST_P(MotionContract, HomingsAreCounted) {
  for (int epoch = 1; epoch <= 2; ++epoch) {
    const auto homed = device().Home({});
    ASSERT_TRUE(homed) << ToString(homed.error());
    EXPECT_EQ(homed->reference_epoch, epoch);
    EXPECT_EQ(device().ReadStatus().reference_epoch, epoch);
  }
}

TEST_P(MotionContract, AMoveEndsAtItsTargetSettledAndIdle) {
  ASSERT_TRUE(device().Home({}));
  for (const StageTarget& target : {StageTarget{30, 10, "a0"}, StageTarget{12.5, 3, "a0"},
                                    StageTarget{12.5, 20, "a0"}, StageTarget{0, 0, "a0"}}) {
    const std::int64_t before_ns = clock().Now().mono_ns;
    const auto moved = device().MoveTo(target, {});
    ASSERT_TRUE(moved) << ToString(moved.error());
    const StagePosition& at = moved->position;
    EXPECT_EQ(at.turntable_deg.commanded, target.turntable_deg);
    EXPECT_EQ(at.lift_mm.commanded, target.lift_mm);
    EXPECT_NEAR(at.turntable_deg.counted, target.turntable_deg, kStepDeg);
    EXPECT_NEAR(at.lift_mm.counted, target.lift_mm, kStepMm);
    EXPECT_GE(moved->settled_mono_ns, before_ns);
    EXPECT_GE(clock().Now().mono_ns, moved->settled_mono_ns);
    const MotionStatus status = device().ReadStatus();
    EXPECT_EQ(status.turntable, AxisState::idle);
    EXPECT_EQ(status.lift, AxisState::idle);
    EXPECT_EQ(status.position, at);
    EXPECT_TRUE(status.fault.empty());
  }
}

TEST_P(MotionContract, TheSameTargetAgainMovesNothing) {
  ASSERT_TRUE(device().Home({}));
  const auto first = device().MoveTo({20, 5, "a0"}, {});
  const auto again = device().MoveTo({20, 5, "a0"}, {});
  ASSERT_TRUE(first && again);
  EXPECT_EQ(first->position, again->position);
}

TEST_P(MotionContract, ARefusedTargetMovesNothing) {
  ASSERT_TRUE(device().Home({}));
  ASSERT_TRUE(device().MoveTo({20, 5, "a0"}, {}));
  const MotionStatus before = device().ReadStatus();
  for (const StageTarget& target :
       {StageTarget{20, -1e6, "a0"}, StageTarget{30, 1e6, "a0"}, StageTarget{std::nan(""), 5, "a0"},
        StageTarget{30, 10, "no-such-aim"}}) {
    const auto moved = device().MoveTo(target, {});
    ASSERT_FALSE(moved);
    EXPECT_EQ(moved.error().kind, ErrorKind::bad_input) << ToString(moved.error());
    EXPECT_FALSE(moved.error().mend.empty());
  }
  EXPECT_EQ(device().ReadStatus().position, before.position);
  EXPECT_TRUE(device().MoveTo({10, 5, "a0"}, {}));
}

TEST_P(MotionContract, AStopKeepsThePosition) {
  ASSERT_TRUE(device().Home({}));
  Participation part(twin.activity);
  if (twin.activity) twin.activity->MessageSent();
  std::thread stopper([&] {
    Participation stopper_part(twin.activity, true);
    clock().SleepFor(300'000'000);
    EXPECT_TRUE(device().Stop());
  });
  const auto moved = device().MoveTo({40, 20, "a0"}, {});
  {
    BlockingWait joining(twin.activity);
    stopper.join();
  }
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::cancelled);
  const MotionStatus status = device().ReadStatus();
  EXPECT_GT(status.position.turntable_deg.counted, 0);
  EXPECT_LT(status.position.turntable_deg.counted, 40);
  EXPECT_EQ(status.reference_epoch, 1);
  const auto onwards = device().MoveTo({40, 20, "a0"}, {});
  ASSERT_TRUE(onwards) << ToString(onwards.error());
  EXPECT_NEAR(onwards->position.turntable_deg.counted, 40, kStepDeg);
}

TEST_P(MotionContract, AStopAtRestIsNoError) {
  EXPECT_TRUE(device().Stop());
  ASSERT_TRUE(device().Home({}));
  EXPECT_TRUE(device().Stop());
  EXPECT_TRUE(device().MoveTo({1, 1, "a0"}, {}));
}

TEST_P(MotionContract, AnAbortLosesThePositionUntilHomed) {
  ASSERT_TRUE(device().Home({}));
  ASSERT_TRUE(device().Abort());
  const auto moved = device().MoveTo({10, 5, "a0"}, {});
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::device);
  ASSERT_TRUE(device().Home({}));
  EXPECT_TRUE(device().MoveTo({10, 5, "a0"}, {}));
}

TEST_P(MotionContract, ARequestedTokenMovesNothing) {
  ASSERT_TRUE(device().Home({}));
  const MotionStatus before = device().ReadStatus();
  std::stop_source stop;
  stop.request_stop();
  const auto moved = device().MoveTo({30, 10, "a0"}, stop.get_token());
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::cancelled);
  EXPECT_EQ(device().ReadStatus().position, before.position);
}

}  // namespace
}  // namespace scan
