#include "drivers/base/virtual_clock.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <tuple>

namespace scan {
namespace {

constexpr std::int64_t kMonoOriginNs = 1'000'000'000;

}  // namespace

VirtualClock::VirtualClock(std::int64_t start_utc_ns)
    : start_utc_ns_(start_utc_ns), mono_ns_(kMonoOriginNs) {}

Timestamp VirtualClock::Now() {
  std::lock_guard lock(mutex_);
  return {start_utc_ns_ + mono_ns_ - kMonoOriginNs, mono_ns_};
}

bool VirtualClock::SleepUntil(std::int64_t mono_ns, std::stop_token stop) {
  Sleeper me;
  me.deadline_ns = mono_ns;
  // Runs inside request_stop(), so the sleeper counts as running before its stopper can sleep.
  std::stop_callback on_stop(stop, [&] {
    std::lock_guard lock(mutex_);
    me.stopped = true;
    if (me.asleep) Wake(me);
  });
  std::unique_lock lock(mutex_);
  if (me.stopped) return false;
  if (mono_ns <= mono_ns_) return true;
  const auto found = participants_.find(std::this_thread::get_id());
  me.counted = found != participants_.end();
  me.order = me.counted ? found->second : std::numeric_limits<int>::max();
  me.asleep = true;
  sleepers_.push_back(&me);
  if (me.counted) --active_;
  AdvanceWhileAllWait();
  me.wake.wait(lock, [&] { return !me.asleep; });
  return !me.stopped;
}

void VirtualClock::Wake(Sleeper& sleeper) {
  sleeper.asleep = false;
  std::erase(sleepers_, &sleeper);
  if (sleeper.counted) ++active_;
  sleeper.wake.notify_one();
}

void VirtualClock::AdvanceWhileAllWait() {
  while (active_ == 0 && !sleepers_.empty()) {
    Sleeper* first = *std::min_element(
        sleepers_.begin(), sleepers_.end(), [](const Sleeper* a, const Sleeper* b) {
          return std::tie(a->deadline_ns, a->order) < std::tie(b->deadline_ns, b->order);
        });
    mono_ns_ = std::max(mono_ns_, first->deadline_ns);
    Wake(*first);
  }
}

void VirtualClock::Join(bool takes_over_message) {
  std::lock_guard lock(mutex_);
  [[maybe_unused]] const bool inserted =
      participants_.emplace(std::this_thread::get_id(), next_order_++).second;
  assert(inserted && "a thread joins once");
  if (!takes_over_message) ++active_;
}

void VirtualClock::Leave() {
  std::lock_guard lock(mutex_);
  if (participants_.erase(std::this_thread::get_id()) == 0) return;
  --active_;
  AdvanceWhileAllWait();
}

void VirtualClock::MessageSent() {
  std::lock_guard lock(mutex_);
  ++active_;
}

void VirtualClock::MessageDropped() {
  std::lock_guard lock(mutex_);
  --active_;
  AdvanceWhileAllWait();
}

void VirtualClock::BeginWait() {
  std::lock_guard lock(mutex_);
  if (!participants_.contains(std::this_thread::get_id())) return;
  --active_;
  AdvanceWhileAllWait();
}

void VirtualClock::EndWait(bool took_message) {
  std::lock_guard lock(mutex_);
  const bool counted = participants_.contains(std::this_thread::get_id());
  if (counted && !took_message) ++active_;
  if (!counted && took_message) {
    --active_;  // nobody answers for it any more
    AdvanceWhileAllWait();
  }
}

}  // namespace scan
