// Pause, resume and cancel of a running capture, from another thread.
#pragma once

#include <condition_variable>
#include <mutex>
#include <stop_token>

namespace scan {

// Pause takes effect before the next device call; Cancel also stops the one under way (the token
// reaches Motion and Camera). A cancelled control stays cancelled: use a new one for the next run.
// Thread contract: any thread.
class CaptureControl {
 public:
  void Pause();
  void Resume();
  void Cancel();

  bool paused() const;
  bool cancelled() const { return stop_.stop_requested(); }
  std::stop_token stop_token() const { return stop_.get_token(); }

  // The runner's side: returns when not paused, or cancelled.
  void WaitWhilePaused();

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool paused_ = false;
  std::stop_source stop_;
};

}  // namespace scan
