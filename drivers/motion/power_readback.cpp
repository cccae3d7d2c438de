#include "drivers/motion/power_readback.h"

#include <chrono>
#include <utility>

namespace scan {

PowerReadback::PowerReadback(std::int64_t limit_ns, bool wired, Report report)
    : limit_ns_(limit_ns), report_(std::move(report)), power_(wired) {
  if (wired) thread_ = std::jthread([this](std::stop_token stop) { Run(stop); });
}

void PowerReadback::OnEmergencyStop(bool pressed) { Change(pressed_, pressed); }
void PowerReadback::OnPower(bool there) { Change(power_, there); }

void PowerReadback::Change(bool& state, bool value) {
  std::lock_guard lock(mutex_);
  state = value;
  changed_.notify_all();
}

void PowerReadback::Run(std::stop_token stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return Contradicts(); })) {
    const bool cut = changed_.wait_for(lock, stop, std::chrono::nanoseconds(limit_ns_),
                                       [this] { return !Contradicts(); });
    if (stop.stop_requested()) return;  // a wait that was stopped still says what holds
    if (cut) continue;
    lock.unlock();
    report_(true);
    lock.lock();
    if (!changed_.wait(lock, stop, [this] { return !Contradicts(); })) return;
    lock.unlock();
    report_(false);
    lock.lock();
  }
}

}  // namespace scan
