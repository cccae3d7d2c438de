// The clock is a device: real, virtual (simulation) or replayed.
#pragma once

#include <cstdint>
#include <stop_token>

namespace scan {

struct Timestamp {
  std::int64_t utc_ns = 0;   // since the epoch
  std::int64_t mono_ns = 0;  // monotonic, origin arbitrary
  friend bool operator==(const Timestamp&, const Timestamp&) = default;
};

// Thread contract: every call may come from any thread.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual Timestamp Now() = 0;
  // Sleeps until the monotonic deadline; returns false when `stop` was requested before it.
  virtual bool SleepUntil(std::int64_t mono_ns, std::stop_token stop = {}) = 0;

  bool SleepFor(std::int64_t ns, std::stop_token stop = {}) {
    return SleepUntil(Now().mono_ns + ns, stop);
  }
};

// CLOCK_REALTIME and CLOCK_MONOTONIC of this machine.
class SystemClock final : public Clock {
 public:
  Timestamp Now() override;
  bool SleepUntil(std::int64_t mono_ns, std::stop_token stop = {}) override;
};

}  // namespace scan
