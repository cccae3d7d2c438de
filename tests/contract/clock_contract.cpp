#include <thread>

#include "tests/contract/twin.h"

namespace scan {
namespace {

constexpr std::int64_t kMs = 1'000'000;

TEST_P(ClockContract, ASleepLastsAtLeastAsAskedOnBothScales) {
  const auto twin = GetParam().make();
  Timestamp before = twin.device->Now();
  for (int k = 0; k < 5; ++k) {
    ASSERT_TRUE(twin.device->SleepUntil(before.mono_ns + 2 * kMs));
    const Timestamp after = twin.device->Now();
    EXPECT_GE(after.mono_ns, before.mono_ns + 2 * kMs);
    EXPECT_GT(after.utc_ns, before.utc_ns);
    before = after;
  }
}

TEST_P(ClockContract, ADeadlineThatHasPassedReturnsAtOnce) {
  const auto twin = GetParam().make();
  EXPECT_TRUE(twin.device->SleepUntil(twin.device->Now().mono_ns - kMs));
  EXPECT_TRUE(twin.device->SleepUntil(0));
}

TEST_P(ClockContract, ARequestedTokenEndsASleep) {
  const auto twin = GetParam().make();
  std::stop_source stop;
  stop.request_stop();
  EXPECT_FALSE(twin.device->SleepFor(3'600'000 * kMs, stop.get_token()));
}

TEST_P(ClockContract, AStopFromAnotherThreadWakesTheSleeper) {
  const auto twin = GetParam().make();
  Clock& clock = *twin.device;
  const Participation part(twin.activity);
  std::stop_source stop;
  const std::int64_t start_ns = clock.Now().mono_ns;
  if (twin.activity) twin.activity->MessageSent();
  std::thread stopper([&] {
    const Participation stopper_part(twin.activity, true);
    clock.SleepUntil(start_ns + 5 * kMs);
    stop.request_stop();
  });
  EXPECT_FALSE(clock.SleepUntil(start_ns + 3'600'000 * kMs, stop.get_token()));
  EXPECT_GE(clock.Now().mono_ns, start_ns + 5 * kMs);
  BlockingWait joining(twin.activity);
  stopper.join();
}

}  // namespace
}  // namespace scan
