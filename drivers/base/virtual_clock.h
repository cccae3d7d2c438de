// The simulation's clock: it advances only when every participant waits.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

#include "drivers/base/activity.h"
#include "drivers/base/clock.h"

namespace scan {

// 2026-01-01T00:00:00Z: every simulated capture starts at the same instant.
constexpr std::int64_t kVirtualStartUtcNs = 1'767'225'600LL * 1'000'000'000LL;

// Starts at `start_utc_ns` with a monotonic time of 1 s. When no participant runs and no message is
// in flight, time jumps to the earliest deadline and wakes one sleeper; equal deadlines wake one
// after the other, in the order in which their threads joined, so runs repeat exactly.
// A thread that never joined may sleep too, but never holds time back.
// Thread contract: every call may come from any thread.
class VirtualClock final : public Clock, public Activity {
 public:
  explicit VirtualClock(std::int64_t start_utc_ns = kVirtualStartUtcNs);

  Timestamp Now() override;
  bool SleepUntil(std::int64_t mono_ns, std::stop_token stop = {}) override;

  void Join(bool takes_over_message) override;
  void Leave() override;
  void MessageSent() override;
  void MessageDropped() override;
  void BeginWait() override;
  void EndWait(bool took_message) override;

 private:
  struct Sleeper {
    std::int64_t deadline_ns = 0;
    int order = 0;  // of joining; INT_MAX for a thread that never joined
    bool counted = false;
    bool asleep = false;
    bool stopped = false;
    std::condition_variable wake;
  };
  void Wake(Sleeper& sleeper);
  void AdvanceWhileAllWait();

  const std::int64_t start_utc_ns_;
  std::mutex mutex_;
  std::int64_t mono_ns_;
  int active_ = 0;  // running participants + messages in flight
  int next_order_ = 0;
  std::map<std::thread::id, int> participants_;  // order of joining
  std::vector<Sleeper*> sleepers_;
};

}  // namespace scan
