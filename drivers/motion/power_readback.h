// Reads back whether an emergency stop has really cut the motors' supply.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <stop_token>
#include <thread>

namespace scan {

// Reports true when the emergency stop is pressed and the supply still there after `limit_ns`, and
// false when that has ended. Does nothing where the supply is not `wired` to an input.
// Thread contract: any thread; reports come on a thread of its own, without a lock held.
class PowerReadback {
 public:
  using Report = std::function<void(bool not_cut)>;
  PowerReadback(std::int64_t limit_ns, bool wired, Report report);

  void OnEmergencyStop(bool pressed);
  void OnPower(bool there);

 private:
  void Run(std::stop_token stop);
  void Change(bool& state, bool value);
  bool Contradicts() const { return pressed_ && power_; }

  const std::int64_t limit_ns_;
  const Report report_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  bool pressed_ = false, power_;
  std::jthread thread_;  // last: it uses all of the above
};

}  // namespace scan
