#include "drivers/motion/tic/tic_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "drivers/base/log.h"

namespace scan {
namespace {

constexpr std::int64_t kKeepAliveNs = 250'000'000;  // a quarter of the boards' command timeout

bool KillSwitch(const TicAxis& axis) {
  return (axis.last().errors & Bit(TicError::kill_switch)) != 0;
}

void LogEnd(const char* what, const Error* error) {
  Log(LogLevel::info, what, {{"outcome", error ? error->what : std::string("done")}});
}

}  // namespace

TicMotion::TicMotion(const TicMotionParts& parts, std::shared_ptr<UsbBus> bus,
                     std::shared_ptr<Clock> clock)
    : clock_(std::move(clock)),
      aim_ids_(parts.aim_ids),
      poll_ns_(std::llround(parts.tic.poll_ms * 1e6)),
      turntable_(parts.turntable, std::make_unique<TicBoard>(bus, parts.tic.turntable)),
      lift_(parts.lift, std::make_unique<TicBoard>(bus, parts.tic.lift)) {}

Result<std::unique_ptr<TicMotion>> TicMotion::Make(const TicMotionParts& parts,
                                                   std::shared_ptr<UsbBus> bus,
                                                   std::shared_ptr<Clock> clock) {
  SCAN_TRY(const auto devices, bus->List());
  const auto board_of = [&](const TicAxisWiring& wiring) {
    return FindUsb(devices, TicSelector(wiring.port, wiring.serial), "Tic board");
  };
  SCAN_TRY(const UsbIdentity turntable, board_of(parts.tic.turntable));
  SCAN_TRY(const UsbIdentity lift, board_of(parts.tic.lift));
  if (turntable.port == lift.port) {
    return BadInput("both axes name the same board", Describe(lift),
                    "give axis.turntable.tic and axis.lift.tic a board each");
  }
  std::unique_ptr<TicMotion> motion(new TicMotion(parts, std::move(bus), std::move(clock)));
  for (TicAxis* axis : motion->axes_) SCAN_CHECK(axis->SetUp());
  return motion;
}

TicMotion::~TicMotion() {
  keep_alive_.request_stop();
  if (keep_alive_.joinable()) keep_alive_.join();
  for (TicAxis* axis : axes_) axis->Leave();
}

StagePosition TicMotion::Position() const { return {turntable_.Reading(), lift_.Reading()}; }

MotionStatus TicMotion::ReadStatus() {
  std::lock_guard lock(mutex_);
  const std::string& fault = turntable_.fault().empty() ? lift_.fault() : turntable_.fault();
  return {turntable_.state(),  lift_.state(),      reference_epoch_, Position(), fault,
          interlocks_.alarm(), interlocks_.Words()};
}

Status TicMotion::Stop() {
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

// The boards hear of it at once, not with the next poll.
Status TicMotion::Abort() {
  std::stop_source wake;
  {
    std::lock_guard lock(mutex_);
    AbortAll();
    abort_requested_ = running_;
    wake = wake_;
  }
  wake.request_stop();
  return {};
}

void TicMotion::AbortAll() {
  for (TicAxis* axis : axes_) {
    if (axis->state() != AxisState::fault) axis->Abort();
  }
}

void TicMotion::CutAll() {
  for (TicAxis* axis : axes_) {
    axis->CutPower(std::string(Row(Interlock::emergency_stop).name));
  }
}

Status TicMotion::LoseHeartbeat() {
  SetInterlock(Interlock::heartbeat_lost, true);
  SetInterlock(Interlock::heartbeat_lost, false);  // latched: a person finds it
  return {};
}

void TicMotion::SetInterlock(Interlock interlock, bool present) {
  std::stop_source wake;
  {
    std::lock_guard lock(mutex_);
    SetInterlockLocked(interlock, present);
    wake = wake_;
  }
  if (present) wake.request_stop();
}

void TicMotion::SetInterlockLocked(Interlock interlock, bool present) {
  if (!present) {
    interlocks_.CauseGone(interlock);
    return;
  }
  interlocks_.Raise(interlock);
  switch (Row(interlock).ends_motion) {
    case MotionEnd::none:
      break;
    case MotionEnd::stop:
      stopped_by_ = interlock;
      stop_requested_ = true;
      break;
    case MotionEnd::abort:
      AbortAll();
      abort_requested_ = true;
      break;
    case MotionEnd::power_cut:
      CutAll();
      cut_requested_ = true;
      break;
  }
}

// A kill switch on one board is the emergency stop of both.
void TicMotion::WatchKillSwitch() {
  const bool pressed = KillSwitch(turntable_) || KillSwitch(lift_);
  if (pressed == kill_switch_pressed_) return;
  kill_switch_pressed_ = pressed;
  SetInterlockLocked(Interlock::emergency_stop, pressed);
}

void TicMotion::KeepAlive() {
  std::lock_guard lock(mutex_);
  if (!running_) KeepAliveLocked();
}

void TicMotion::KeepAliveLocked() {
  for (TicAxis* axis : axes_) {
    if (const Status kept = axis->KeepAlive(); !kept) {
      Log(LogLevel::error, "tic_lost", {{"what", ToString(kept.error())}});
    }
  }
  WatchKillSwitch();
}

void TicMotion::StartKeepAlive() {
  keep_alive_ = std::jthread([this](std::stop_token stop) {
    SystemClock clock;
    while (clock.SleepFor(kKeepAliveNs, stop)) KeepAlive();
  });
}

Status TicMotion::Acknowledge() {
  std::lock_guard lock(mutex_);
  if (!running_) KeepAliveLocked();  // is the cause gone?
  interlocks_.Acknowledge();
  return {};
}

void TicMotion::Begin() {
  assert(!running_ && "Home and MoveTo come from one thread at a time");
  running_ = true;
  stop_requested_ = abort_requested_ = cut_requested_ = false;
  stopped_by_.reset();
  wake_ = std::stop_source();
}

// What came while the motion was ending is not lost.
Status TicMotion::EndLocked() {
  running_ = false;
  if (cut_requested_) return tl::unexpected(EndError(Outcome::power_cut));
  if (abort_requested_) return tl::unexpected(EndError(Outcome::aborted));
  return {};
}

// Of a motion that did not finish. Precondition: not finished.
Error TicMotion::EndError(Outcome outcome) const {
  if (outcome == Outcome::power_cut) {
    return {ErrorKind::device,
            "emergency stop: the motors are without power, the position is unknown", "stage",
            "release it, acknowledge it (scanstation device motion acknowledge), home the stage"};
  }
  if (outcome == Outcome::aborted) {
    return {ErrorKind::device, "motion was aborted, the position is unknown", "stage",
            "home the stage"};
  }
  const StagePosition at = Position();
  const std::string where =
      fmt::format("at {:.3f} {}, {:.3f} {}", at.turntable_deg.counted, turntable_.config().unit,
                  at.lift_mm.counted, lift_.config().unit);
  if (stopped_by_) {
    return {ErrorKind::device,
            fmt::format("motion was stopped {}: {}", where, Row(*stopped_by_).name), "stage",
            "remove the cause, then move on"};
  }
  return {ErrorKind::cancelled, "motion was stopped " + where, "stage", "move on when ready"};
}

Status TicMotion::PollAll(std::int64_t now_ns) {
  for (TicAxis* axis : axes_) {
    Status polled = axis->Poll(now_ns);
    WatchKillSwitch();  // cuts the power of both, whatever else went wrong
    if (polled || cut_requested_) continue;
    if (axis->limit_hit()) {
      interlocks_.Raise(Interlock::limit_switch);
      interlocks_.CauseGone(Interlock::limit_switch);
    }
    AbortAll();
    return polled;
  }
  return {};
}

Result<TicMotion::Outcome> TicMotion::Play() {
  bool stopping = false;
  for (;;) {
    std::stop_token token;
    const std::int64_t now_ns = clock_->Now().mono_ns;
    {
      std::lock_guard lock(mutex_);
      if (!cut_requested_ && !abort_requested_) {
        if (stop_requested_ && !stopping) {
          stopping = true;
          for (TicAxis* axis : axes_) {
            if (Status stopped = axis->BeginStop(now_ns); !stopped) {
              AbortAll();
              return tl::unexpected(stopped.error());
            }
          }
        }
        SCAN_CHECK(PollAll(now_ns));
      }
      if (cut_requested_) return Outcome::power_cut;
      if (abort_requested_) return Outcome::aborted;
      if (std::none_of(axes_.begin(), axes_.end(), [](TicAxis* axis) { return axis->busy(); })) {
        return stopping ? Outcome::stopped : Outcome::finished;
      }
      if (wake_.stop_requested()) wake_ = std::stop_source();
      token = wake_.get_token();
    }
    clock_->SleepUntil(now_ns + poll_ns_, token);
  }
}

Result<HomeReport> TicMotion::Home(std::stop_token stop) {
  {
    std::lock_guard lock(mutex_);
    if (stop.stop_requested()) return Cancelled("homing");
    KeepAliveLocked();
    SCAN_CHECK(interlocks_.Permit(AxisCommand::home));
    Begin();
    settled_mono_ns_ = 0;
  }
  Status homed;
  {
    const std::stop_callback on_stop(stop, [this] { (void)Stop(); });
    homed = Homing();
  }
  std::lock_guard lock(mutex_);
  const Status ended = EndLocked();
  if (homed) homed = ended;
  LogEnd("home", homed ? nullptr : &homed.error());
  if (!homed) return tl::unexpected(homed.error());
  interlocks_.Homed();
  return HomeReport{++reference_epoch_, Position()};
}

Status TicMotion::Homing() {
  for (TicAxis* axis : axes_) {
    {
      std::lock_guard lock(mutex_);
      if (!cut_requested_ && !abort_requested_) {
        if (stop_requested_) return Cancelled("homing of " + axis->config().name);
        SCAN_CHECK(axis->BeginHoming(clock_->Now().mono_ns));
      }
    }
    SCAN_TRY(const Outcome outcome, Play());
    std::lock_guard lock(mutex_);
    if (outcome == Outcome::finished) continue;
    if (outcome != Outcome::stopped || stopped_by_) return tl::unexpected(EndError(outcome));
    return Cancelled("homing of " + axis->config().name);
  }
  return {};
}

Status TicMotion::CheckTarget(const StageTarget& target) const {
  SCAN_CHECK(turntable_.CheckTarget(target.turntable_deg));
  SCAN_CHECK(lift_.CheckTarget(target.lift_mm));
  if (std::find(aim_ids_.begin(), aim_ids_.end(), target.aim_id) != aim_ids_.end()) return {};
  return BadInput(fmt::format("the station has no aim '{}'", target.aim_id), "aim_id",
                  fmt::format("choose one of: {}", fmt::join(aim_ids_, ", ")));
}

Result<MoveReport> TicMotion::MoveTo(const StageTarget& target, std::stop_token stop) {
  {
    std::lock_guard lock(mutex_);
    SCAN_CHECK(CheckTarget(target));
    SCAN_CHECK(interlocks_.Permit(AxisCommand::move));
    if (stop.stop_requested()) return Cancelled("move");
    Begin();
  }
  const std::stop_callback on_stop(stop, [this] { (void)Stop(); });
  auto moved = Moving(target);
  {
    std::lock_guard lock(mutex_);
    if (const Status ended = EndLocked(); moved && !ended) moved = tl::unexpected(ended.error());
  }
  LogEnd("move", moved ? nullptr : &moved.error());
  return moved;
}

Result<MoveReport> TicMotion::Moving(const StageTarget& target) {
  bool moved = false;
  {
    std::lock_guard lock(mutex_);
    const std::int64_t now_ns = clock_->Now().mono_ns;
    Status begun = turntable_.BeginMove(target.turntable_deg, now_ns);
    if (begun) begun = lift_.BeginMove(target.lift_mm, now_ns);
    if (!begun) {
      AbortAll();
      return tl::unexpected(begun.error());
    }
    moved = turntable_.busy() || lift_.busy();
  }
  SCAN_TRY(const Outcome outcome, Play());
  std::unique_lock lock(mutex_);
  if (outcome != Outcome::finished) return tl::unexpected(EndError(outcome));
  if (moved || settled_mono_ns_ == 0) {
    settled_mono_ns_ =
        clock_->Now().mono_ns + std::max(turntable_.config().settle_ns, lift_.config().settle_ns);
  }
  const std::stop_token token = wake_.get_token();
  const std::int64_t settled_ns = settled_mono_ns_;
  lock.unlock();
  clock_->SleepUntil(settled_ns, token);
  lock.lock();
  if (cut_requested_) return tl::unexpected(EndError(Outcome::power_cut));
  if (abort_requested_) return tl::unexpected(EndError(Outcome::aborted));
  if (stop_requested_) return tl::unexpected(EndError(Outcome::stopped));
  return MoveReport{Position(), settled_mono_ns_};
}

Result<std::unique_ptr<Motion>> MakeTicMotion(const TicMotionParts& parts,
                                              std::shared_ptr<UsbBus> bus,
                                              std::shared_ptr<Clock> clock) {
  SCAN_TRY(auto motion, TicMotion::Make(parts, std::move(bus), std::move(clock)));
  motion->StartKeepAlive();
  return motion;
}

}  // namespace scan
