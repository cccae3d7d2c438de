#include "drivers/motion/tic/tic_axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "drivers/base/log.h"
#include "drivers/motion/axis_target.h"

namespace scan {
namespace {

constexpr std::int64_t kReadyNs = 2'000'000'000;   // for coils to settle and errors to clear
constexpr std::int64_t kSpareNs = 2'000'000'000;   // beyond what a motion should take
constexpr std::int64_t kAliveNs = 100'000'000;     // a tenth of the command timeout
constexpr std::uint16_t kCommandTimeoutMs = 1000;  // then the board ramps down by itself
constexpr std::uint8_t kRampDownAndHold = 2;
constexpr double kOvershootPerBacklash = 1.5;  // as Axis
constexpr int kQuietPolls = 2;                 // still at two polls: stopped
constexpr auto kCleared =                      // go by themselves while the board gets ready
    static_cast<std::uint16_t>(Bit(TicError::safe_start) | Bit(TicError::command_timeout) |
                               Bit(TicError::deenergized) | Bit(TicError::serial));

std::int32_t Encoded(double value, double most) {
  return static_cast<std::int32_t>(std::llround(std::clamp(value, 1.0, most)));
}

std::int64_t Ns(double seconds) { return std::llround(seconds * 1e9); }

}  // namespace

TicAxis::TicAxis(AxisConfig config, std::unique_ptr<TicBoard> board)
    : config_(std::move(config)), board_(std::move(board)) {
  assert(board_ && config_.steps_per_unit > 0 && std::abs(config_.sign) == 1);
}

double TicAxis::UnitsAt(std::int64_t steps) const {
  return config_.homing.position +
         config_.sign * static_cast<double>(steps) / config_.steps_per_unit;
}

std::int64_t TicAxis::StepsAt(double units) const {
  return std::llround((units - config_.homing.position) * config_.sign * config_.steps_per_unit);
}

AxisReading TicAxis::Reading() const {
  return {commanded_, UnitsAt(last_.position), estimated_, config_.sigma_shared,
          config_.sigma_view};
}

void TicAxis::Advance(AxisEvent event) {
  const auto next = Next(state_, event);
  assert(next && "the owner asked for what the axis table excludes");
  if (next) state_ = *next;
}

Status TicAxis::Fault(std::string what, std::string mend) {
  phase_ = Phase::rest;
  targets_.clear();
  referenced_ = false;
  fault_ = what;
  Advance(AxisEvent::faulted);
  if (board_->is_open()) (void)board_->Send(TicCommand::halt_and_hold);  // it is a fault already
  return DeviceFault(std::move(what), config_.name, std::move(mend));
}

Status TicAxis::Checked(Status status) {
  if (status) return {};
  (void)Fault(status.error().what, status.error().mend);
  return status;
}

Status TicAxis::SetUp() {
  SCAN_CHECK(board_->Open());
  const std::string where = fmt::format("axis.{}: {}", config_.name, Describe(board_->identity()));
  SCAN_TRY(TicSettings settings, board_->ReadSettings());
  if (settings.control_mode != 0) {
    return DeviceFault("the board does not take its targets from USB", where,
                       "set its control mode to 'Serial / I2C / USB' with Pololu's Tic Control "
                       "Center");
  }
  if ((HomesForward() ? settings.forward_limit_pins : settings.reverse_limit_pins) == 0) {
    const char* name = HomesForward() ? "Limit switch forward" : "Limit switch reverse";
    return DeviceFault("the board has no pin for the home switch", where,
                       fmt::format("set the pin of the switch to '{}' with Pololu's Tic Control "
                                   "Center, or correct homing.direction and positive_steps",
                                   name));
  }
  settings.command_timeout_ms = kCommandTimeoutMs;
  settings.soft_error_response = kRampDownAndHold;
  const auto speed = [&](double velocity) {
    return static_cast<std::uint32_t>(Encoded(velocity * config_.steps_per_unit * kTicSpeedPerHz,
                                              kTicMaxSpeedHz * kTicSpeedPerHz));
  };
  settings.homing_speed_towards = speed(config_.homing.fast);
  settings.homing_speed_away = speed(config_.homing.slow);
  SCAN_TRY(const bool written, board_->WriteSettings(settings));
  if (written) {
    Log(LogLevel::info, "tic_settings", {{"axis", config_.name}, {"written", "yes"}});
  }
  if (const int microsteps = board_->wiring().microsteps; microsteps > 0) {
    SCAN_TRY(const std::uint8_t mode, TicStepMode(microsteps));
    SCAN_CHECK(board_->Send(TicCommand::set_step_mode, mode));
    SCAN_TRY(const TicVariables variables, board_->ReadVariables());
    if (variables.step_mode != mode) {
      return DeviceFault(fmt::format("the board does not make {} microsteps", microsteps), where,
                         "lower axis." + config_.name + ".tic.microsteps");
    }
  }
  SCAN_CHECK(board_->Send(TicCommand::deenergize));
  SCAN_TRY(last_, board_->ReadVariables());
  return {};
}

Status TicAxis::SendLimits() {
  const double hz = config_.steps_per_unit;
  const auto speed = [&](double velocity) {
    return Encoded(velocity * hz * kTicSpeedPerHz, kTicMaxSpeedHz * kTicSpeedPerHz);
  };
  const std::int32_t acceleration =
      Encoded(std::max(config_.acceleration * hz, kTicMinAccelHz2) * kTicAccelPerHz2,
              std::numeric_limits<std::int32_t>::max());
  SCAN_CHECK(board_->Send(TicCommand::set_max_speed, speed(config_.velocity)));
  SCAN_CHECK(board_->Send(TicCommand::set_starting_speed, speed(config_.self_start)));
  SCAN_CHECK(board_->Send(TicCommand::set_max_accel, acceleration));
  return board_->Send(TicCommand::set_max_decel, acceleration);
}

Status TicAxis::CheckTarget(double target) const {
  // The board counts in 32 bits; the overshoot of a last approach fits into the margin.
  const double reach = 2e9 / config_.steps_per_unit;
  AxisConfig within = config_;
  within.min = config_.min.value_or(config_.homing.position - reach);
  within.max = config_.max.value_or(config_.homing.position + reach);
  return CheckAxisTarget(within, state_, fault_, target);
}

Status TicAxis::BeginMove(double target, std::int64_t now_ns) {
  assert(!busy());
  commanded_ = target;
  targets_.clear();
  const std::int64_t goal = StepsAt(target);
  if (goal == last_.position) return {};
  if (config_.backlash > 0 && (goal - last_.position) * config_.sign * config_.approach < 0) {
    targets_.push_back(
        StepsAt(target - config_.approach * kOvershootPerBacklash * config_.backlash));
  }
  targets_.push_back(goal);
  // The board must not go on to a target from before an error. This also ends a command timeout.
  SCAN_CHECK(Checked(board_->Send(TicCommand::set_target_velocity, 0)));
  SCAN_CHECK(Checked(SendLimits()));
  Advance(AxisEvent::motion_started);
  to_home_ = false;
  phase_ = Phase::readying;
  deadline_ns_ = now_ns + kReadyNs;
  return {};
}

Status TicAxis::BeginHoming(std::int64_t now_ns) {
  assert(!busy());
  if (!board_->is_open()) SCAN_CHECK(Checked(SetUp()));
  targets_.clear();
  referenced_ = false;
  // Halting makes the board's position uncertain, and only a homing that ends well makes it
  // certain.
  for (const TicCommand command :
       {TicCommand::clear_driver_error, TicCommand::halt_and_hold, TicCommand::energize}) {
    SCAN_CHECK(Checked(board_->Send(command)));
  }
  SCAN_CHECK(Checked(SendLimits()));
  if (state_ == AxisState::fault) Advance(AxisEvent::acknowledged);
  if (state_ == AxisState::unpowered) Advance(AxisEvent::powered);
  fault_.clear();
  limit_hit_ = false;
  Advance(AxisEvent::motion_started);
  to_home_ = true;
  phase_ = Phase::readying;
  deadline_ns_ = now_ns + kReadyNs;
  return {};
}

Status TicAxis::BeginStop(std::int64_t now_ns) {
  if (phase_ == Phase::rest || phase_ == Phase::stopping) return {};
  targets_.clear();
  phase_ = Phase::stopping;
  quiet_polls_ = 0;
  deadline_ns_ = now_ns + Ns(config_.velocity / config_.acceleration) + kSpareNs;
  return Checked(to_home_ ? board_->Send(TicCommand::halt_and_hold)
                          : board_->Send(TicCommand::set_target_velocity, 0));
}

Status TicAxis::Poll(std::int64_t now_ns) {
  if (phase_ == Phase::rest) return {};
  auto variables = board_->ReadVariables();
  if (!variables) return Checked(tl::unexpected(variables.error()));
  const std::int32_t before = last_.position;
  last_ = *variables;
  quiet_polls_ = last_.velocity == 0 && last_.position == before ? quiet_polls_ + 1 : 0;
  if (now_ns - alive_ns_ >= kAliveNs || now_ns < alive_ns_) {
    SCAN_CHECK(Checked(board_->Send(TicCommand::reset_command_timeout)));
    alive_ns_ = now_ns;
  }
  if (phase_ == Phase::readying) return Ready(now_ns);
  if (last_.errors != 0 && phase_ != Phase::stopping) {
    return Fault(fmt::format("the board stopped: {}", TicErrorWords(last_.errors)),
                 TicErrorMend(last_.errors));
  }
  switch (phase_) {
    case Phase::travelling:
      return FollowTravel(now_ns);
    case Phase::homing:
      return FollowHoming(now_ns);
    default:
      return FollowStop(now_ns);
  }
}

Status TicAxis::Ready(std::int64_t now_ns) {
  const std::uint16_t lasting = last_.errors & static_cast<std::uint16_t>(~kCleared);
  const bool normal = last_.errors == 0 && last_.state == TicState::normal;
  if (normal && !to_home_ && last_.position_uncertain) {
    return Fault("the board has lost its position", "check its supply, then home again");
  }
  if (normal && to_home_ == last_.position_uncertain) {
    if (!to_home_) return StartLeg(now_ns);
    const HomingConfig& homing = config_.homing;
    const double seconds = homing.max_travel / std::min(homing.fast, config_.velocity) +
                           2 * config_.velocity / config_.acceleration +
                           2 * homing.back_off / homing.slow;
    deadline_ns_ = now_ns + Ns(seconds) + kSpareNs;
    leg_from_ = last_.position;
    phase_ = Phase::homing;
    return Checked(board_->Send(TicCommand::go_home, HomesForward() ? 1 : 0));
  }
  if (now_ns >= deadline_ns_) {
    const std::uint16_t errors = lasting ? lasting : last_.errors;
    return Fault(fmt::format("the board does not get ready: {}",
                             errors ? TicErrorWords(errors) : std::string(NameOf(last_.state))),
                 TicErrorMend(errors));
  }
  return Checked(board_->Send(TicCommand::exit_safe_start));
}

Status TicAxis::StartLeg(std::int64_t now_ns) {
  leg_from_ = last_.position;
  const double distance =
      std::abs(static_cast<double>(targets_.front() - leg_from_)) / config_.steps_per_unit;
  deadline_ns_ =
      now_ns + Ns(1.2 * distance / config_.velocity + 2 * config_.velocity / config_.acceleration) +
      kSpareNs;
  phase_ = Phase::travelling;
  return Checked(
      board_->Send(TicCommand::set_target_position, static_cast<std::int32_t>(targets_.front())));
}

Status TicAxis::FollowTravel(std::int64_t now_ns) {
  FollowBacklash();
  const std::int64_t target = targets_.front();
  if (last_.position == target && last_.velocity == 0 && last_.target_position == target) {
    targets_.pop_front();
    return targets_.empty() ? EndMove(false) : StartLeg(now_ns);
  }
  if (target > leg_from_ ? last_.forward_limit : last_.reverse_limit) {
    limit_hit_ = true;
    return Fault("ran onto its limit switch",
                 "home the stage; check for lost steps, and that the limits of the configuration "
                 "lie inside the switches");
  }
  if (last_.position_uncertain) {
    return Fault("the board has lost its position", "check its supply, then home again");
  }
  if (now_ns >= deadline_ns_) {
    return Fault(fmt::format("the board did not arrive: it is at {:.3f} {}",
                             UnitsAt(last_.position), config_.unit),
                 "home the stage; check that nothing else gives the board orders");
  }
  return {};
}

Status TicAxis::FollowHoming(std::int64_t now_ns) {
  if (!last_.homing && !last_.position_uncertain) {
    SetReference();
    return {};
  }
  const double travelled =
      std::abs(static_cast<double>(last_.position - leg_from_)) / config_.steps_per_unit;
  if (now_ns < deadline_ns_ && travelled <= config_.homing.max_travel) return {};
  const bool active = HomesForward() ? last_.forward_limit : last_.reverse_limit;
  return Fault(active ? "the home switch stayed active"
                      : fmt::format("the home switch did not come within {} {}",
                                    config_.homing.max_travel, config_.unit),
               "check the switch, its wiring, its polarity in the board's settings, and the "
               "direction of homing");
}

Status TicAxis::FollowStop(std::int64_t now_ns) {
  FollowBacklash();
  if (referenced_ && last_.position_uncertain) {
    const std::string errors = TicErrorWords(last_.errors);
    return Fault(
        fmt::format("the board has lost its position{}{}", errors.empty() ? "" : ": ", errors),
        TicErrorMend(last_.errors));
  }
  if (quiet_polls_ >= kQuietPolls) return EndMove(true);
  if (now_ns < deadline_ns_) return {};
  return Fault("the board did not stop", "cut the motor supply; then home again");
}

// As Axis::EndMove.
Status TicAxis::EndMove(bool stopped) {
  phase_ = Phase::rest;
  targets_.clear();
  if (!referenced_) {
    Advance(AxisEvent::aborted);  // homing is not yet done
    return {};
  }
  Advance(stopped ? AxisEvent::stopped : AxisEvent::arrived);
  if (!stopped || config_.on_stop != OnStop::release) return {};
  referenced_ = false;
  Advance(AxisEvent::released);
  return Checked(board_->Send(TicCommand::deenergize));
}

void TicAxis::SetReference() {
  phase_ = Phase::rest;
  commanded_ = estimated_ = config_.homing.position;
  referenced_ = true;
  Advance(AxisEvent::homed);
}

// As Axis::FollowBacklash; a leg ends with a poll, so no turning point is missed.
void TicAxis::FollowBacklash() {
  const double x = UnitsAt(last_.position);
  const double low = config_.approach > 0 ? x : x - config_.backlash;
  const double high = config_.approach > 0 ? x + config_.backlash : x;
  estimated_ = std::clamp(estimated_, low, high);
}

Status TicAxis::KeepAlive() {
  if (busy() || !board_->is_open()) return {};
  SCAN_CHECK(Checked(board_->Send(TicCommand::reset_command_timeout)));
  auto variables = board_->ReadVariables();
  if (!variables) return Checked(tl::unexpected(variables.error()));
  last_ = *variables;
  if (referenced_ && last_.position_uncertain) {
    const std::string errors = TicErrorWords(last_.errors);
    return Fault(
        fmt::format("the board has lost its position{}{}", errors.empty() ? "" : ": ", errors),
        TicErrorMend(last_.errors));
  }
  return {};
}

void TicAxis::Abort() {
  phase_ = Phase::rest;
  targets_.clear();
  referenced_ = false;
  Advance(AxisEvent::aborted);
  if (!board_->is_open()) return;
  if (const Status sent = board_->Send(TicCommand::halt_and_hold); !sent) {
    fault_ = sent.error().what;
    Advance(AxisEvent::faulted);
  }
}

void TicAxis::CutPower(std::string why) {
  phase_ = Phase::rest;
  targets_.clear();
  referenced_ = false;
  fault_ = std::move(why);
  Advance(AxisEvent::faulted);
  if (board_->is_open()) (void)board_->Send(TicCommand::deenergize);  // it is a fault already
}

void TicAxis::Leave() {
  if (!board_->is_open()) return;
  const bool stays = config_.on_stop == OnStop::release || config_.self_locking;
  (void)board_->Send(stays ? TicCommand::deenergize : TicCommand::set_target_velocity);
}

}  // namespace scan
