// Every fault is recovered within the call or a clear error, and nothing stays held.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <cstring>
#include <thread>

#include "tests/support/v4l2_bench.h"

namespace scan {
namespace {

// Of one call, from what V4l2Camera states: 2 (time-out + reconnection) + frames.
constexpr std::int64_t kLongestCallNs = 2 * (5 * kSecondNs) + 80LL * 33'000'000;

void ExpectClear(const Error& error) {
  EXPECT_EQ(error.kind, ErrorKind::device) << ToString(error);
  EXPECT_FALSE(error.what.empty());
  EXPECT_FALSE(error.where.empty());
  EXPECT_FALSE(error.mend.empty());
}

class FailedCall : public ::testing::TestWithParam<int> {};

TEST_P(FailedCall, AnyOneCallThatFailsOnceIsRecoveredOrAnErrorOfTheOpening) {
  V4l2Bench counting;
  ASSERT_TRUE(counting.Open());
  const int opening_calls = counting.system->calls;
  ASSERT_TRUE(counting.camera->Configure({.exposure_us = 4000.0, .gain = {}}));
  ASSERT_TRUE(counting.camera->Grab({}));
  const int all_calls = counting.system->calls;
  ASSERT_GT(all_calls, opening_calls + 10);

  for (int n = 1; n <= all_calls; ++n) {
    SCOPED_TRACE("call " + std::to_string(n) + " of " + std::to_string(all_calls));
    V4l2Bench bench;
    bench.system->fail_at = n;
    bench.system->fail_errno = GetParam();
    const std::int64_t start_ns = bench.now_ns();
    if (const Status opened = bench.Open(); !opened) {
      ASSERT_LE(n, opening_calls);
      if (opened.error().kind == ErrorKind::device) ExpectClear(opened.error());
      bench.ExpectNothingHeld();
      ASSERT_TRUE(bench.Open());  // the fault was of that moment
    }
    const auto applied = bench.camera->Configure({.exposure_us = 4000.0, .gain = {}});
    ASSERT_TRUE(applied) << ToString(applied.error());
    EXPECT_EQ(applied->exposure_us, 4000);
    const auto frame = bench.camera->Grab({});
    ASSERT_TRUE(frame) << ToString(frame.error());
    EXPECT_EQ(frame->applied.exposure_us, 4000);
    EXPECT_LE(bench.now_ns() - start_ns, 2 * kLongestCallNs);
    bench.camera.reset();
    bench.ExpectNothingHeld();
  }
}

class FailedForGood : public ::testing::TestWithParam<int> {};

TEST_P(FailedForGood, CallsThatFailFromThenOnAreAClearFaultAndLeaveNothing) {
  for (int n = 1; n < 60; n += 3) {
    V4l2Bench bench;
    ASSERT_TRUE(bench.Open());
    ASSERT_TRUE(bench.camera->Grab({}));
    bench.system->fail_at = bench.system->calls + n;
    bench.system->fail_count = 1'000'000;
    bench.system->fail_errno = GetParam();
    // A call that fails after the picture was read spoils the next frame only.
    std::int64_t start_ns = bench.now_ns();
    auto frame = bench.camera->Grab({});
    for (int i = 0; frame && i < 20; ++i) {
      start_ns = bench.now_ns();
      frame = bench.camera->Grab({});
    }
    ASSERT_FALSE(frame);
    ExpectClear(frame.error());
    EXPECT_LE(bench.now_ns() - start_ns, kLongestCallNs);
    bench.ExpectNothingHeld();
    bench.system->fail_at = 0;
    const auto after = bench.camera->Grab({});
    EXPECT_TRUE(after) << ToString(after.error());
  }
}

const auto kErrnoName = [](const auto& instance) {
  return std::string(strerrorname_np(instance.param));
};
INSTANTIATE_TEST_SUITE_P(Errors, FailedCall,
                         ::testing::Values(EIO, ENODEV, EAGAIN, EINTR, ENOMEM, EBUSY, ENOSPC),
                         kErrnoName);
INSTANTIATE_TEST_SUITE_P(Errors, FailedForGood,
                         ::testing::Values(EIO, ENODEV, EAGAIN, EINTR, ENOMEM, EBUSY, ENOSPC),
                         kErrnoName);

struct FaultCase {
  const char* name;
  FrameFault fault;
  const char* format;
  const char* words;
};

class DamagedFrame : public ::testing::TestWithParam<FaultCase> {
 public:
  V4l2CameraOptions Options() {
    V4l2CameraOptions options;
    options.config.pixel_format = GetParam().format;
    return options;
  }
};

TEST_P(DamagedFrame, OneIsDroppedAndTheNextTaken) {
  for (std::uint32_t first = 4; first < 9; ++first) {
    V4l2Bench bench({}, Options());
    for (std::uint32_t i = first; i < first + 2; ++i)
      bench.system->frame_faults[i] = GetParam().fault;
    ASSERT_TRUE(bench.Open());
    std::optional<std::uint64_t> last;
    for (int grab = 0; grab < 4; ++grab) {
      const std::int64_t called_ns = bench.now_ns();
      const auto frame = bench.camera->Grab({});
      ASSERT_TRUE(frame) << ToString(frame.error());
      EXPECT_FALSE(
          bench.system->frame_faults.contains(static_cast<std::uint32_t>(frame->sensor_sequence)));
      EXPECT_GE(bench.system->truth(frame->sensor_sequence).exposure_start_ns, called_ns);
      if (last) {
        EXPECT_GT(frame->sensor_sequence, *last);
      }
      last = frame->sensor_sequence;
    }
    EXPECT_EQ(bench.camera->counters().restarts, 0);
    const auto& counters = bench.camera->counters();
    EXPECT_GE(counters.damaged + counters.disordered + counters.stale, 1);
  }
}

class DamagedFrames : public DamagedFrame {};

TEST_P(DamagedFrames, AreAFaultThatSaysSo) {
  V4l2Bench bench({}, Options());
  ASSERT_TRUE(bench.Open());
  bench.system->every_frame = GetParam().fault;
  const std::int64_t start_ns = bench.now_ns();
  const auto frame = bench.camera->Grab({});
  ASSERT_FALSE(frame);
  ExpectClear(frame.error());
  EXPECT_THAT(frame.error().what, testing::HasSubstr(GetParam().words));
  EXPECT_LE(bench.now_ns() - start_ns, kLongestCallNs);
  EXPECT_EQ(bench.camera->counters().restarts, 1);
  bench.system->every_frame = FrameFault::none;
  EXPECT_TRUE(bench.camera->Grab({}));
}

const FaultCase kFaultCases[] = {{"short", FrameFault::short_frame, "YUYV", "of 6144 bytes"},
                                 {"long", FrameFault::long_frame, "YUYV", "a whole one has 6144"},
                                 {"empty", FrameFault::empty, "YUYV", "empty"},
                                 {"empty_jpeg", FrameFault::empty, "MJPG", "empty"},
                                 {"flagged", FrameFault::flagged, "YUYV", "marks the frame"},
                                 {"flagged_jpeg", FrameFault::flagged, "MJPG", "marks the frame"},
                                 {"cut_jpeg", FrameFault::cut_jpeg, "MJPG", "damaged JPEG"},
                                 {"spoiled_jpeg", FrameFault::spoiled_jpeg, "MJPG", "damaged JPEG"},
                                 {"future", FrameFault::future_stamp, "YUYV", "does not follow"}};
// Only one frame out of the order: all of them three lower are a sequence in order.
const FaultCase kStaleSequence = {"sequence", FrameFault::stale_sequence, "YUYV", ""};
const auto kFaultName = [](const auto& instance) { return std::string(instance.param.name); };
INSTANTIATE_TEST_SUITE_P(Faults, DamagedFrame, ::testing::ValuesIn(kFaultCases), kFaultName);
INSTANTIATE_TEST_SUITE_P(Stale, DamagedFrame, ::testing::Values(kStaleSequence), kFaultName);
INSTANTIATE_TEST_SUITE_P(Faults, DamagedFrames, ::testing::ValuesIn(kFaultCases), kFaultName);

TEST(V4l2Faults, StampsThatLieBackAreNeverTakenForFreshFrames) {
  V4l2Bench bench;
  ASSERT_TRUE(bench.Open());
  ASSERT_TRUE(bench.camera->Grab({}));
  bench.system->every_frame = FrameFault::stale_stamp;
  const std::int64_t called_ns = bench.now_ns();
  const auto frame = bench.camera->Grab({});
  if (frame) {
    EXPECT_GE(frame->exposure.not_before_ns, called_ns);
  } else {
    ExpectClear(frame.error());
  }
}

TEST(V4l2Faults, ACameraThatPausesIsRestarted) {
  V4l2Bench bench;
  ASSERT_TRUE(bench.Open());
  ASSERT_TRUE(bench.camera->Grab({}));
  bench.system->silent_from_ns = bench.now_ns();
  bench.system->silent_until_ns = bench.now_ns() + kSecondNs * 5 / 2;
  const auto frame = bench.camera->Grab({});
  ASSERT_TRUE(frame) << ToString(frame.error());
  EXPECT_EQ(bench.camera->counters().restarts, 1);
}

TEST(V4l2Faults, ACameraThatStaysSilentIsAFaultWithinTheStatedTime) {
  V4l2Bench bench;
  ASSERT_TRUE(bench.Open());
  bench.system->silent_from_ns = bench.now_ns();
  const std::int64_t start_ns = bench.now_ns();
  const auto frame = bench.camera->Grab({});
  ASSERT_FALSE(frame);
  ExpectClear(frame.error());
  EXPECT_THAT(frame.error().what, testing::HasSubstr("no more frames"));
  EXPECT_LE(bench.now_ns() - start_ns, kLongestCallNs);
  bench.ExpectNothingHeld();
}

TEST(V4l2Faults, AReplugInMidStreamIsRecoveredWithAllSettings) {
  V4l2CameraOptions options;
  options.config.controls = {{"brightness", "-12"}};
  for (std::int64_t after_ns = 0; after_ns < 120'000'000; after_ns += 7'000'000) {
    V4l2Bench bench({}, options);
    ASSERT_TRUE(bench.Open());
    ASSERT_TRUE(bench.camera->Configure({.exposure_us = 4000.0, .gain = {}}));
    const auto before = bench.camera->Grab({});
    ASSERT_TRUE(before);
    bench.system->UnplugAt(bench.now_ns() + after_ns, bench.now_ns() + after_ns + kSecondNs);
    Result<Frame> frame = bench.camera->Grab({});
    while (frame && bench.camera->counters().restarts == 0) frame = bench.camera->Grab({});
    ASSERT_TRUE(frame) << ToString(frame.error());
    EXPECT_GT(frame->sensor_sequence, before->sensor_sequence);
    EXPECT_EQ(frame->applied.exposure_us, 4000);
    EXPECT_EQ(bench.camera->device()->node().path, "/dev/video2");  // another number
    EXPECT_EQ(bench.system->control(V4L2_CID_BRIGHTNESS).value, -12);
    EXPECT_EQ(bench.system->open_descriptors(), 1);
    bench.camera.reset();
    bench.ExpectNothingHeld();
  }
}

TEST(V4l2Faults, ACameraThatStaysAwayIsAFaultUntilItIsBack) {
  V4l2Bench bench;
  ASSERT_TRUE(bench.Open());
  bench.system->UnplugAt(bench.now_ns(), bench.now_ns() + 60 * kSecondNs);
  const std::int64_t start_ns = bench.now_ns();
  const auto frame = bench.camera->Grab({});
  ASSERT_FALSE(frame);
  ExpectClear(frame.error());
  EXPECT_THAT(frame.error().what, testing::HasSubstr("not there"));
  EXPECT_LE(bench.now_ns() - start_ns, kLongestCallNs);
  EXPECT_FALSE(bench.camera->Configure({.exposure_us = 5000.0, .gain = {}}));
  bench.ExpectNothingHeld();
  bench.clock->SleepFor(60 * kSecondNs);
  const auto after = bench.camera->Grab({});
  ASSERT_TRUE(after) << ToString(after.error());
  EXPECT_EQ(after->applied.exposure_us, 5000);  // asked for while it was away
}

TEST(V4l2Faults, AFormatChangedByAnotherProgramIsSetAgain) {
  for (const char* format : {"YUYV", "MJPG"}) {
    V4l2CameraOptions options;
    options.config.pixel_format = format;
    V4l2Bench bench({}, options);
    ASSERT_TRUE(bench.Open());
    const int w = bench.camera->Info().w;
    ASSERT_TRUE(bench.camera->Grab({}));
    bench.system->ChangeFormat(32, 24);
    const auto frame = bench.camera->Grab({});
    ASSERT_TRUE(frame) << ToString(frame.error());
    EXPECT_EQ(bench.camera->Info().w, w);
    EXPECT_EQ(bench.camera->stream()->format().w, w);
    EXPECT_EQ(bench.camera->counters().restarts, 1);
  }
}

TEST(V4l2Faults, AStopEndsTheWaitForACameraThatIsGone) {
  V4l2CameraOptions options;
  options.config.reconnect_ms = 3'600'000;
  V4l2Bench bench({}, options);
  ASSERT_TRUE(bench.Open());
  bench.system->UnplugAt(bench.now_ns(), INT64_MAX);
  std::stop_source stop;
  const std::int64_t start_ns = bench.now_ns();
  const Participation part(bench.clock.get());
  bench.clock->MessageSent();
  std::thread stopper([&] {
    const Participation stopper_part(bench.clock.get(), true);
    bench.clock->SleepFor(kSecondNs);
    stop.request_stop();
  });
  const auto frame = bench.camera->Grab(stop.get_token());
  {
    BlockingWait joining(bench.clock.get());
    stopper.join();
  }
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().kind, ErrorKind::cancelled);
  EXPECT_LE(bench.now_ns() - start_ns, 2 * kSecondNs);
}

}  // namespace
}  // namespace scan
