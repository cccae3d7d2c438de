// What a simulated clock must hear from its users to know when all of them wait. A real clock needs
// none of it: code that talks over messages carries an `Activity*` that may be null.
#pragma once

namespace scan {

// Time may advance only while no participant runs and no message is in flight.
// A sender calls MessageSent before it writes; the receiver's EndWait(true) takes that message
// over, so that time cannot jump between the two.
// Thread contract: every call may come from any thread; Join, Leave, BeginWait and EndWait speak
// for the calling thread.
class Activity {
 public:
  virtual ~Activity() = default;
  // The calling thread takes part from now on. `takes_over_message`: whoever started this thread
  // called MessageSent first, so that time stood still until now.
  virtual void Join(bool takes_over_message) = 0;
  virtual void Leave() = 0;
  virtual void MessageSent() = 0;
  // A message that nobody will ever read (its channel was closed).
  virtual void MessageDropped() = 0;
  // Brackets a blocking read: between the two the thread counts as waiting.
  virtual void BeginWait() = 0;
  virtual void EndWait(bool took_message) = 0;
};

// The calling thread takes part while this lives. Must die on the thread that made it.
class Participation {
 public:
  explicit Participation(Activity* activity, bool takes_over_message = false)
      : activity_(activity) {
    if (activity_) activity_->Join(takes_over_message);
  }
  ~Participation() {
    if (activity_) activity_->Leave();
  }
  Participation(const Participation&) = delete;
  Participation& operator=(const Participation&) = delete;

 private:
  Activity* activity_;
};

// Brackets one blocking read; call TookMessage when the read gave a message.
class BlockingWait {
 public:
  explicit BlockingWait(Activity* activity) : activity_(activity) {
    if (activity_) activity_->BeginWait();
  }
  ~BlockingWait() {
    if (activity_) activity_->EndWait(took_message_);
  }
  BlockingWait(const BlockingWait&) = delete;
  BlockingWait& operator=(const BlockingWait&) = delete;
  void TookMessage() { took_message_ = true; }

 private:
  Activity* activity_;
  bool took_message_ = false;
};

}  // namespace scan
