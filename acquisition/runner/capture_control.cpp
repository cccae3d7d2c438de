#include "acquisition/runner/capture_control.h"

namespace scan {

void CaptureControl::Pause() {
  std::lock_guard lock(mutex_);
  paused_ = true;
}

void CaptureControl::Resume() {
  {
    std::lock_guard lock(mutex_);
    paused_ = false;
  }
  changed_.notify_all();
}

void CaptureControl::Cancel() {
  stop_.request_stop();  // first, so that a device call under way ends without waiting for the lock
  std::lock_guard lock(mutex_);
  changed_.notify_all();
}

bool CaptureControl::paused() const {
  std::lock_guard lock(mutex_);
  return paused_;
}

void CaptureControl::WaitWhilePaused() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !paused_ || stop_.stop_requested(); });
}

}  // namespace scan
