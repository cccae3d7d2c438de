// A thread whose deadlines the kernel keeps, and a clock for it.
#pragma once

#include <optional>
#include <string>

#include "drivers/base/clock.h"

namespace scan {

struct RealTimeOptions {
  int priority = 50;        // of SCHED_FIFO, 1 to 99; 0: an ordinary thread
  std::optional<int> core;  // runs there alone; nothing: wherever the kernel likes
  friend bool operator==(const RealTimeOptions&, const RealTimeOptions&) = default;
};

// What the kernel granted; the words say how to get what it did not.
struct RealTimeGrant {
  bool fifo = false;
  bool memory_locked = false;
  bool pinned = false;
  std::string mend;  // empty when everything asked for was granted
};

// Makes the calling thread a real-time one, and locks the program's memory where that cannot make
// later allocations fail.
RealTimeGrant BecomeRealTime(const RealTimeOptions& options);

// CLOCK_MONOTONIC; sleeps to shortly before a deadline, then spins up to it, for at most half of
// the wait (waits below 20 us, such as a pulse, wholly): a thread that steps at any rate stays far
// below the 95 % beyond which the kernel throttles real-time threads. A stop token ends a sleep
// within 2 ms. Allocates nothing.
class RealTimeClock final : public Clock {
 public:
  Timestamp Now() override;
  bool SleepUntil(std::int64_t mono_ns, std::stop_token stop = {}) override;
};

}  // namespace scan
