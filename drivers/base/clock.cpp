#include "drivers/base/clock.h"

#include <time.h>

#include <chrono>
#include <condition_variable>
#include <mutex>

namespace scan {
namespace {

std::int64_t ReadClock(clockid_t id) {
  timespec t{};
  clock_gettime(id, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

}  // namespace

Timestamp SystemClock::Now() { return {ReadClock(CLOCK_REALTIME), ReadClock(CLOCK_MONOTONIC)}; }

bool SystemClock::SleepUntil(std::int64_t mono_ns, std::stop_token stop) {
  // libstdc++'s steady_clock is CLOCK_MONOTONIC.
  const std::chrono::steady_clock::time_point deadline{std::chrono::nanoseconds(mono_ns)};
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  wake.wait_until(lock, stop, deadline, [] { return false; });
  return !stop.stop_requested();
}

}  // namespace scan
