// Turntable and lift driven by step edges.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>

#include "drivers/base/clock.h"
#include "drivers/motion/aim_preset.h"
#include "drivers/motion/axis.h"
#include "drivers/motion/interlocks.h"
#include "drivers/motion/lateness.h"
#include "drivers/motion/motion.h"
#include "drivers/motion/priority_mutex.h"

namespace scan {

// What a homing or a move was like, for the log.
struct MotionRecord {
  std::string what;              // home move
  std::string outcome;           // done, or the error's words
  LatenessHistogram lateness;    // of every step against its deadline
  std::int64_t late_shifts = 0;  // late steps, each of which shifted the rest
  std::int64_t shifted_ns = 0;   // by so much in all
};

// Plays the edges of all axes, merged by deadline, on the thread that calls Home or MoveTo.
// Errors beyond those of Motion: bad_input for a target outside the limits, not a number, or an
// aim that the station does not have; nothing has moved then.
class StepperMotion final : public Motion {
 public:
  struct Parts {
    std::shared_ptr<Clock> clock;
    std::unique_ptr<Axis> turntable;
    std::unique_ptr<Axis> lift;
    std::unique_ptr<AimPreset> aim;  // may be null: the station has none, and aims are ignored
    // May be empty; called when a homing or a move has ended, on its thread.
    std::function<void(const MotionRecord&)> on_end;
  };
  explicit StepperMotion(Parts parts);

  Result<HomeReport> Home(std::stop_token stop) override;
  Result<MoveReport> MoveTo(const StageTarget& target, std::stop_token stop) override;
  Status Stop() override;
  Status Abort() override;
  // As Stop() or harder: what the interlock's row says. From any thread, also while a move runs.
  void SetInterlock(Interlock interlock, bool present);
  Status LoseHeartbeat() override;
  Status Acknowledge() override;
  MotionStatus ReadStatus() override;

 private:
  enum class Outcome { finished, tripped, stopped, aborted, power_cut };
  // Asked after every edge; true ramps that axis down.
  using Trip = std::function<Result<bool>(Axis&)>;

  void Begin();
  Result<Outcome> Play(std::span<Axis* const> axes, const Trip& trip);
  Status EndAll(std::span<Axis* const> axes);
  void AbortAll();
  void CutAll();
  Status EmitStep(Axis& axis);
  Error EndError(Outcome outcome);
  std::optional<Error> EndHard();
  Result<HomeReport> HomeAll();
  Result<MoveReport> MoveAll(const StageTarget& target, std::stop_token stop);
  template <class T>
  Result<T> Recorded(const char* what, Result<T> result);
  Result<MoveReport> FinishMove(const Result<Outcome>& outcome, Axis* on_limit, bool moved);
  Result<bool> Travel(Axis& axis, double distance, double velocity, std::optional<bool> until);
  Status HomeAxis(Axis& axis);
  void SleepFor(std::int64_t duration_ns);  // less when a stop comes
  Status FindEdgeSlowly(Axis& axis, bool ran_into);
  Status HomingFault(Axis& axis, const std::string& what, const std::string& mend);
  Status CheckTarget(const StageTarget& target) const;
  Result<bool> LimitHit(Axis& axis);
  StagePosition Position() const;
  std::int64_t Shifts() const;
  std::int64_t ShiftedNs() const;

  Parts parts_;
  PriorityMutex mutex_;  // guards all below and the axes
  std::stop_source wake_;
  bool stop_requested_ = false;
  bool abort_requested_ = false;
  bool cut_requested_ = false;
  std::optional<Interlock> stopped_by_;
  Interlock cut_by_ = Interlock::emergency_stop;
  Interlocks interlocks_;
  MotionRecord record_;
  bool running_ = false;
  int reference_epoch_ = 0;
  std::int64_t settled_mono_ns_ = 0;
};

}  // namespace scan
