#include "drivers/motion/stepper_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <mutex>

namespace scan {
namespace {

constexpr std::int64_t kStartDelayNs = 1'000'000;  // from the decision to the time base of a move

}  // namespace

StepperMotion::StepperMotion(Parts parts) : parts_(std::move(parts)) {
  assert(parts_.clock && parts_.turntable && parts_.lift);
}

StagePosition StepperMotion::Position() const {
  return {parts_.turntable->Reading(), parts_.lift->Reading()};
}

MotionStatus StepperMotion::ReadStatus() {
  std::lock_guard lock(mutex_);
  std::string fault = parts_.turntable->fault();
  if (fault.empty()) fault = parts_.lift->fault();
  return {parts_.turntable->state(), parts_.lift->state(), reference_epoch_, Position(), fault,
          interlocks_.alarm(),       interlocks_.Words()};
}

Status StepperMotion::Stop() {
  std::stop_source wake;
  {
    std::lock_guard lock(mutex_);
    if (!running_) return {};
    stop_requested_ = true;
    wake = wake_;
  }
  wake.request_stop();
  return {};
}

Status StepperMotion::Abort() {
  std::stop_source wake;
  {
    std::lock_guard lock(mutex_);
    if (!running_) {
      AbortAll();
      return {};
    }
    abort_requested_ = true;
    wake = wake_;
  }
  wake.request_stop();
  return {};
}

void StepperMotion::SetInterlock(Interlock interlock, bool present) {
  std::stop_source wake;
  {
    std::lock_guard lock(mutex_);
    if (!present) {
      interlocks_.CauseGone(interlock);
      return;
    }
    interlocks_.Raise(interlock);
    switch (Row(interlock).ends_motion) {
      case MotionEnd::none:
        return;
      case MotionEnd::stop:
        stopped_by_ = interlock;
        stop_requested_ = true;
        break;
      case MotionEnd::abort:
        if (!running_) AbortAll();
        abort_requested_ = true;
        break;
      case MotionEnd::power_cut:
        // A supply that goes because of the emergency stop is no cause of its own.
        cut_by_ =
            interlock == Interlock::motor_power_off && interlocks_.IsUp(Interlock::emergency_stop)
                ? Interlock::emergency_stop
                : interlock;
        if (!running_) CutAll();
        cut_requested_ = true;
        break;
    }
    wake = wake_;
  }
  wake.request_stop();
}

Status StepperMotion::LoseHeartbeat() {
  SetInterlock(Interlock::heartbeat_lost, true);
  SetInterlock(Interlock::heartbeat_lost, false);  // latched: a person finds it
  return {};
}

Status StepperMotion::Acknowledge() {
  std::lock_guard lock(mutex_);
  interlocks_.Acknowledge();
  return {};
}

void StepperMotion::AbortAll() {
  parts_.turntable->Abort();
  parts_.lift->Abort();
}

void StepperMotion::CutAll() {
  for (Axis* axis : {parts_.turntable.get(), parts_.lift.get()}) {
    axis->CutPower(std::string(Row(cut_by_).name));
  }
}

std::int64_t StepperMotion::Shifts() const {
  return parts_.turntable->late_shifts() + parts_.lift->late_shifts();
}
std::int64_t StepperMotion::ShiftedNs() const {
  return parts_.turntable->shifted_ns() + parts_.lift->shifted_ns();
}

Status StepperMotion::EndAll(std::span<Axis* const> axes) {
  for (Axis* axis : axes) SCAN_CHECK(axis->EndMove());
  return {};
}

// Of a motion that did not finish. Precondition: `outcome` is stopped, aborted or power_cut.
Error StepperMotion::EndError(Outcome outcome) {
  if (outcome == Outcome::power_cut) {
    return {ErrorKind::device,
            fmt::format("{}: the motors are without {}, the position is unknown", Row(cut_by_).name,
                        cut_by_ == Interlock::motor_power_not_cut ? "current" : "power"),
            "stage",
            cut_by_ == Interlock::emergency_stop
                ? "release it, acknowledge it (scanstation device motion acknowledge), home the "
                  "stage"
                : "check the contact that cuts the motors' supply and the line that reads it back, "
                  "acknowledge it (scanstation device motion acknowledge), home the stage"};
  }
  if (outcome == Outcome::aborted) {
    return {ErrorKind::device, "motion was aborted, the position is unknown", "stage",
            "home the stage"};
  }
  const StagePosition at = Position();
  const std::string where =
      fmt::format("at {:.3f} {}, {:.3f} {}", at.turntable_deg.counted,
                  parts_.turntable->config().unit, at.lift_mm.counted, parts_.lift->config().unit);
  if (stopped_by_) {
    return {ErrorKind::device,
            fmt::format("motion was stopped {}: {}", where, Row(*stopped_by_).name), "stage",
            Row(*stopped_by_).latched
                ? "remove the cause, acknowledge it (scanstation device motion "
                  "acknowledge), then move on"
                : "remove the cause, then move on"};
  }
  return {ErrorKind::cancelled, "motion was stopped " + where, "stage", "move on when ready"};
}

Result<StepperMotion::Outcome> StepperMotion::Play(std::span<Axis* const> axes, const Trip& trip) {
  bool stopping = false, tripped = false;
  for (;;) {
    Axis* next = nullptr;
    std::stop_token token;
    {
      std::lock_guard lock(mutex_);
      if (cut_requested_) {
        CutAll();
        return Outcome::power_cut;
      }
      if (abort_requested_) {
        AbortAll();
        return Outcome::aborted;
      }
      if (stop_requested_ && !stopping) {
        for (Axis* axis : axes) axis->BeginStop();
        stopping = true;
      }
      if (wake_.stop_requested()) wake_ = std::stop_source();
      token = wake_.get_token();
      for (Axis* axis : axes) {
        const auto deadline = axis->NextDeadlineNs();
        if (deadline && (!next || *deadline < *next->NextDeadlineNs())) next = axis;
      }
    }
    if (!next) break;
    // Only this thread changes deadlines.
    if (!parts_.clock->SleepUntil(*next->NextDeadlineNs(), token)) continue;
    std::lock_guard lock(mutex_);
    if (abort_requested_ || cut_requested_) continue;
    Status emitted = EmitStep(*next);
    Result<bool> trips = emitted && trip ? trip(*next) : Result<bool>(false);
    if (!emitted || !trips) {
      AbortAll();
      if (emitted) next->SetFault(trips.error().what);
      return tl::unexpected(emitted ? trips.error() : emitted.error());
    }
    if (*trips) {
      tripped = true;
      for (Axis* axis : axes) axis->BeginStop();
    }
  }
  std::lock_guard lock(mutex_);
  SCAN_CHECK(EndAll(axes));
  return stopping ? Outcome::stopped : tripped ? Outcome::tripped : Outcome::finished;
}

Status StepperMotion::EmitStep(Axis& axis) {
  const std::int64_t now_ns = parts_.clock->Now().mono_ns;
  record_.lateness.Add(now_ns - *axis.NextDeadlineNs());
  Status emitted = axis.EmitNext(now_ns);
  if (!emitted && axis.state() == AxisState::fault) {  // the law of late steps
    interlocks_.Raise(Interlock::late_step);
    interlocks_.CauseGone(Interlock::late_step);
  }
  return emitted;
}

void StepperMotion::Begin() {
  assert(!running_ && "Home and MoveTo come from one thread at a time");
  running_ = true;
  stop_requested_ = false;
  abort_requested_ = false;
  cut_requested_ = false;
  stopped_by_.reset();
  record_ = MotionRecord();
  record_.late_shifts = -Shifts();
  record_.shifted_ns = -ShiftedNs();
  wake_ = std::stop_source();
}

// An emergency stop or an abort that came while no edges were played. With the lock held.
std::optional<Error> StepperMotion::EndHard() {
  if (cut_requested_) {
    CutAll();
    return EndError(Outcome::power_cut);
  }
  if (!abort_requested_) return std::nullopt;
  AbortAll();
  return EndError(Outcome::aborted);
}

// Ends what Begin() began, and tells of it.
template <class T>
Result<T> StepperMotion::Recorded(const char* what, Result<T> result) {
  MotionRecord record;
  {
    std::lock_guard lock(mutex_);
    if (!running_) return result;  // refused before anything moved
    // Until now SetInterlock and Abort leave it to this thread, whatever else went wrong with it.
    if (auto hard = EndHard()) result = tl::unexpected(*std::move(hard));
    running_ = false;
    record_.what = what;
    record_.outcome = result ? "done" : result.error().what;
    record_.late_shifts += Shifts();
    record_.shifted_ns += ShiftedNs();
    record = record_;
  }
  if (parts_.on_end) parts_.on_end(record);
  return result;
}

Result<HomeReport> StepperMotion::Home(std::stop_token stop) {
  {
    std::lock_guard lock(mutex_);
    if (stop.stop_requested()) return Cancelled("homing");
    SCAN_CHECK(interlocks_.Permit(AxisCommand::home));
    Begin();
    settled_mono_ns_ = 0;
  }
  const std::stop_callback on_stop(stop, [this] { (void)Stop(); });
  return Recorded("home", HomeAll());
}

Result<MoveReport> StepperMotion::MoveTo(const StageTarget& target, std::stop_token stop) {
  return Recorded("move", MoveAll(target, stop));
}

Status StepperMotion::CheckTarget(const StageTarget& target) const {
  SCAN_CHECK(parts_.turntable->CheckTarget(target.turntable_deg));
  SCAN_CHECK(parts_.lift->CheckTarget(target.lift_mm));
  if (!parts_.aim) return {};
  const auto ids = parts_.aim->Ids();
  if (std::find(ids.begin(), ids.end(), target.aim_id) == ids.end()) {
    return BadInput(fmt::format("the station has no aim '{}'", target.aim_id), "aim_id",
                    fmt::format("choose one of: {}", fmt::join(ids, ", ")));
  }
  return {};
}

// An axis that runs onto its own endstop in a move has lost its position.
Result<bool> StepperMotion::LimitHit(Axis& axis) {
  const HomingConfig& homing = axis.config().homing;
  if (homing.kind != HomingKind::endstop || axis.last_sense() != homing.direction) return false;
  return axis.HomeSwitch();
}

Result<MoveReport> StepperMotion::MoveAll(const StageTarget& target, std::stop_token stop) {
  const std::array axes{parts_.turntable.get(), parts_.lift.get()};
  bool moved = false;
  {
    std::lock_guard lock(mutex_);
    SCAN_CHECK(CheckTarget(target));
    SCAN_CHECK(interlocks_.Permit(AxisCommand::move));
    if (stop.stop_requested()) return Cancelled("move");
    if (parts_.aim && parts_.aim->Current() != target.aim_id) {
      SCAN_CHECK(parts_.aim->GoTo(target.aim_id));
      moved = true;
    }
    Begin();
    const std::int64_t base_ns = parts_.clock->Now().mono_ns + kStartDelayNs;
    Status begun = parts_.turntable->BeginMove(target.turntable_deg, base_ns);
    if (begun) begun = parts_.lift->BeginMove(target.lift_mm, base_ns);
    if (!begun) {
      AbortAll();
      return tl::unexpected(begun.error());
    }
    for (Axis* axis : axes) moved = moved || axis->NextDeadlineNs();
  }
  const std::stop_callback on_stop(stop, [this] { (void)Stop(); });
  Axis* on_limit = nullptr;
  const auto outcome = Play(axes, [&](Axis& axis) -> Result<bool> {
    if (axis.stopping()) return false;
    SCAN_TRY(const bool hit, LimitHit(axis));
    if (hit) on_limit = &axis;
    return hit;
  });
  return FinishMove(outcome, on_limit, moved);
}

Result<MoveReport> StepperMotion::FinishMove(const Result<Outcome>& outcome, Axis* on_limit,
                                             bool moved) {
  std::unique_lock lock(mutex_);
  const std::int64_t now_ns = parts_.clock->Now().mono_ns;
  if (moved || settled_mono_ns_ == 0) {
    settled_mono_ns_ =
        now_ns + std::max(parts_.turntable->config().settle_ns, parts_.lift->config().settle_ns);
  }
  if (outcome && *outcome == Outcome::finished) {
    const std::stop_token token = wake_.get_token();
    const std::int64_t settled_ns = settled_mono_ns_;
    lock.unlock();
    parts_.clock->SleepUntil(settled_ns, token);
    lock.lock();
  }
  if (!outcome) return tl::unexpected(outcome.error());
  if (on_limit) {
    interlocks_.Raise(Interlock::limit_switch);
    interlocks_.CauseGone(Interlock::limit_switch);
    on_limit->SetFault("ran onto its limit switch");
    return DeviceFault(on_limit->fault(), on_limit->config().name,
                       "home the stage; check for lost steps, and that the limits of the "
                       "configuration lie inside the switches");
  }
  if (const auto hard = EndHard()) return tl::unexpected(*hard);
  if (*outcome == Outcome::stopped || stop_requested_) {
    return tl::unexpected(EndError(Outcome::stopped));
  }
  return MoveReport{Position(), settled_mono_ns_};
}

Result<HomeReport> StepperMotion::HomeAll() {
  Axis* axis = parts_.lift.get();
  Status homed = HomeAxis(*axis);
  if (homed) homed = HomeAxis(*(axis = parts_.turntable.get()));
  std::lock_guard lock(mutex_);
  if (const auto hard = EndHard()) return tl::unexpected(*hard);  // perhaps after the last step
  if (!homed) {
    // A switch that could not be read, such as one that keeps bouncing, is a fault as any other.
    const bool own = homed.error().kind == ErrorKind::device && !stopped_by_;
    if (own && axis->state() != AxisState::fault) axis->SetFault(homed.error().what);
    return tl::unexpected(homed.error());
  }
  interlocks_.Homed();
  return HomeReport{++reference_epoch_, Position()};
}

// Runs until the home switch reads `until` (if given); false when the distance ended before.
Result<bool> StepperMotion::Travel(Axis& axis, double distance, double velocity,
                                   std::optional<bool> until) {
  {
    std::lock_guard lock(mutex_);
    SCAN_CHECK(axis.BeginTravel(distance, velocity, parts_.clock->Now().mono_ns + kStartDelayNs));
  }
  Axis* axes[] = {&axis};
  bool seen = false;
  SCAN_TRY(const Outcome outcome, Play(axes, [&](Axis& moving) -> Result<bool> {
             if (seen || !until) return false;
             SCAN_TRY(const bool active, moving.HomeSwitch());
             seen = active == *until;
             return seen;
           }));
  std::lock_guard lock(mutex_);
  if (outcome == Outcome::aborted || outcome == Outcome::power_cut || stopped_by_) {
    return tl::unexpected(EndError(outcome));
  }
  if (outcome == Outcome::stopped) return Cancelled("homing of " + axis.config().name);
  return seen;
}

Status StepperMotion::HomingFault(Axis& axis, const std::string& what, const std::string& mend) {
  std::lock_guard lock(mutex_);
  axis.SetFault(what);
  return DeviceFault(what, axis.config().name, mend);
}

Status StepperMotion::HomeAxis(Axis& axis) {
  const HomingConfig& homing = axis.config().homing;
  const char* name = homing.kind == HomingKind::endstop ? "endstop" : "index mark";
  bool active = false;
  {
    std::lock_guard lock(mutex_);
    SCAN_CHECK(axis.BeginHoming());
    SCAN_TRY(active, axis.HomeSwitch());
  }
  // Leaves a switch that is active at the start, else looks for it.
  const int direction = active ? -homing.direction : homing.direction;
  SCAN_TRY(const bool found, Travel(axis, direction * homing.max_travel, homing.fast, !active));
  if (!found) {
    return HomingFault(
        axis,
        fmt::format("{} {} within {} {}", name, active ? "stayed active" : "did not come",
                    homing.max_travel, axis.config().unit),
        "check the switch, its wiring and the direction of homing");
  }
  return FindEdgeSlowly(axis, !active);
}

void StepperMotion::SleepFor(std::int64_t duration_ns) {
  std::stop_token token;
  {
    std::lock_guard lock(mutex_);
    token = wake_.get_token();
  }
  parts_.clock->SleepUntil(parts_.clock->Now().mono_ns + duration_ns, token);
}

// Goes slowly over the switch's edge in the sense of `approach`, so that backlash plays no part,
// and twice: a switch that bounces or wanders shows as two counts.
Status StepperMotion::FindEdgeSlowly(Axis& axis, bool ran_into) {
  const AxisConfig& config = axis.config();
  const HomingConfig& homing = config.homing;
  const bool enters = homing.direction == config.approach;  // else the edge is that of leaving
  const double ramp = homing.fast * homing.fast / (2 * config.acceleration);
  const double search = 2 * (ramp + homing.back_off + config.backlash);
  std::int64_t counts[2] = {0, 0};
  for (int round = 0; round < 2; ++round) {
    // The fast ramp ended behind the edge when it ran into the switch, before it when it left it.
    const bool on_wrong_side = ran_into == enters;
    if (round > 0 || on_wrong_side) {
      const double distance = homing.back_off + (round == 0 ? ramp : 0);
      SCAN_TRY([[maybe_unused]] const bool unused,
               Travel(axis, -config.approach * distance, homing.fast, std::nullopt));
    }
    SleepFor(config.settle_ns);  // for the switch, and for news of it to arrive
    bool active = false;
    {
      std::lock_guard lock(mutex_);
      SCAN_TRY(active, axis.HomeSwitch());
    }
    if (active == enters) {
      return HomingFault(axis,
                         fmt::format("home switch is {} after backing off",
                                     active ? "still active" : "not active"),
                         "check the switch and homing.back_off");
    }
    SCAN_TRY(const bool found, Travel(axis, config.approach * search, homing.slow, enters));
    if (!found) {
      return HomingFault(axis, "home switch did not change on the slow approach",
                         "check the switch and its wiring");
    }
    counts[round] = axis.counted_steps();
  }
  if (std::abs(counts[1] - counts[0]) > homing.repeat_steps) {
    return HomingFault(axis,
                       fmt::format("home switch came {} steps apart on two approaches",
                                   std::abs(counts[1] - counts[0])),
                       "check the switch for bounce and the axis for lost steps, or raise "
                       "homing.repeat_steps for a switch as coarse as a stall");
  }
  std::lock_guard lock(mutex_);
  axis.SetReference();
  return {};
}

}  // namespace scan
