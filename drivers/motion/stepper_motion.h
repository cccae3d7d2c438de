// Turntable and lift driven by step edges.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <stop_token>

#include "drivers/base/clock.h"
#include "drivers/motion/aim_preset.h"
#include "drivers/motion/axis.h"
#include "drivers/motion/motion.h"

namespace scan {

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
  };
  explicit StepperMotion(Parts parts);

  Result<HomeReport> Home(std::stop_token stop) override;
  Result<MoveReport> MoveTo(const StageTarget& target, std::stop_token stop) override;
  Status Stop() override;
  Status Abort() override;
  MotionStatus ReadStatus() override;

 private:
  enum class Outcome { finished, tripped, stopped, aborted };
  // Asked after every edge; true ramps that axis down.
  using Trip = std::function<Result<bool>(Axis&)>;

  void Begin();
  Result<Outcome> Play(std::span<Axis* const> axes, const Trip& trip);
  Status EndAll(std::span<Axis* const> axes);
  void AbortAll();
  Result<MoveReport> FinishMove(const Result<Outcome>& outcome, Axis* on_limit, bool moved);
  Result<bool> Travel(Axis& axis, double distance, double velocity, std::optional<bool> until);
  Status HomeAxis(Axis& axis);
  Status FindEdgeSlowly(Axis& axis, bool ran_into);
  Status HomingFault(Axis& axis, const std::string& what, const std::string& mend);
  Status CheckTarget(const StageTarget& target) const;
  Result<bool> LimitHit(Axis& axis);
  StagePosition Position() const;
  Error StoppedError();
  Error AbortedError();

  Parts parts_;
  std::mutex mutex_;  // guards all below and the axes
  std::stop_source wake_;
  bool stop_requested_ = false;
  bool abort_requested_ = false;
  bool running_ = false;
  int reference_epoch_ = 0;
  std::int64_t settled_mono_ns_ = 0;
};

}  // namespace scan
