#include "drivers/motion/tic/sim_tic.h"

#include <algorithm>
#include <cmath>

namespace scan {
namespace {

constexpr std::int64_t kStepNs = 250'000;  // of the integration
constexpr double kSafeStartOpenS = 0.2;    // after Exit safe start
constexpr double kStartUpS = 0.01;         // coil current stabilises
constexpr double kHomingWaitS = 0.02;      // at the switch
constexpr std::uint16_t kHard =
    static_cast<std::uint16_t>(Bit(TicError::motor_driver) | Bit(TicError::low_vin));

bool EndsCommandTimeout(TicCommand command) {
  switch (command) {
    case TicCommand::set_target_position:
    case TicCommand::set_target_velocity:
    case TicCommand::halt_and_set_position:
    case TicCommand::halt_and_hold:
    case TicCommand::energize:
    case TicCommand::exit_safe_start:
    case TicCommand::go_home:
    case TicCommand::reset_command_timeout:
      return true;
    default:
      return false;
  }
}

}  // namespace

SimTic::SimTic(Options options) : options_(std::move(options)) {
  now_ns_ = options_.clock->Now().mono_ns;
  place_ = static_cast<double>(options_.start);
  origin_ = options_.start;
  EncodeTicSettings(options_.settings, memory_);
  LoadSettings();
  UpdateErrors();
}

void SimTic::LoadSettings() { settings_ = DecodeTicSettings(memory_); }

bool SimTic::ForwardLimit() const {
  if (settings_.forward_limit_pins == 0) return false;
  if (forced_limits_) return *forced_limits_;
  return options_.forward_edge && std::llround(place_) >= *options_.forward_edge;
}

bool SimTic::ReverseLimit() const {
  if (settings_.reverse_limit_pins == 0) return false;
  if (forced_limits_) return *forced_limits_;
  return options_.reverse_edge && std::llround(place_) <= *options_.reverse_edge;
}

void SimTic::Advance() {
  const std::int64_t now_ns = options_.clock->Now().mono_ns;
  while (now_ns_ < now_ns) {
    const std::int64_t dt_ns = std::min(kStepNs, now_ns - now_ns_);
    now_ns_ += dt_ns;
    Step(static_cast<double>(dt_ns) * 1e-9);
  }
  UpdateErrors();
}

void SimTic::Step(double dt_s) {
  since_command_s_ += dt_s;
  safe_start_open_s_ = std::max(0.0, safe_start_open_s_ - dt_s);
  starting_s_ = std::max(0.0, starting_s_ - dt_s);
  UpdateErrors();
  if (!Normal() && homing_ != Homing::off) homing_ = Homing::off;
  if (homing_ != Homing::off) UpdateHoming(dt_s);
  UpdateVelocity(dt_s);
  if ((velocity_ > 0 && ForwardLimit()) || (velocity_ < 0 && ReverseLimit())) velocity_ = 0;
  place_ += velocity_ * dt_s;
}

void SimTic::UpdateErrors() {
  const auto set = [this](TicError error, bool on) {
    errors_ = static_cast<std::uint16_t>(on ? errors_ | Bit(error) : errors_ & ~Bit(error));
  };
  set(TicError::deenergized, deenergized_);
  set(TicError::motor_driver, overheated_);
  set(TicError::low_vin, !supplied_);
  set(TicError::kill_switch, kill_);
  set(TicError::command_timeout,
      settings_.command_timeout_ms > 0 && since_command_s_ * 1e3 > settings_.command_timeout_ms);
  if (safe_start_open_s_ > 0) {
    set(TicError::safe_start, false);
  } else if (!Normal() && state_ != TicState::starting_up) {
    set(TicError::safe_start, true);
  }
  const bool powerless = (errors_ & (kHard | Bit(TicError::deenergized))) != 0;
  if (powerless) {
    state_ = (errors_ & kHard) ? TicState::reset : TicState::deenergized;
    velocity_ = 0;
    uncertain_ = true;
  } else if (errors_ != 0) {
    state_ = TicState::soft_error;
    if (settings_.soft_error_response < 2 && velocity_ != 0) {
      velocity_ = 0;
      uncertain_ = true;
    }
  } else if (state_ != TicState::normal && state_ != TicState::starting_up) {
    state_ = TicState::starting_up;
    starting_s_ = kStartUpS;
  } else if (starting_s_ <= 0) {
    state_ = TicState::normal;
  }
}

void SimTic::RampTo(double goal, double dt_s) {
  const double start = starting_speed_ / kTicSpeedPerHz;
  const double up = max_accel_ / kTicAccelPerHz2 * dt_s;
  const double down = max_decel_ / kTicAccelPerHz2 * dt_s;
  if (velocity_ * goal < 0 || std::abs(goal) < std::abs(velocity_)) {
    const double slower = std::max(std::abs(velocity_) - down, 0.0);
    const double least = velocity_ * goal < 0 ? 0.0 : std::abs(goal);
    velocity_ = std::copysign(slower <= start ? least : std::max(slower, least), velocity_);
  } else {
    const double faster = std::max(std::abs(velocity_) + up, start);
    velocity_ = std::copysign(std::min(faster, std::abs(goal)), goal);
  }
}

void SimTic::UpdateVelocity(double dt_s) {
  if (!Normal()) {
    RampTo(0, dt_s);
    return;
  }
  const double most = max_speed_ / kTicSpeedPerHz;
  if (input_ == Input::halt) {
    velocity_ = 0;
  } else if (input_ == Input::velocity) {
    RampTo(std::clamp(input_value_ / kTicSpeedPerHz, -most, most), dt_s);
  } else {
    const double target = static_cast<double>(input_value_ + origin_);
    const double left = target - place_;
    const double decel = max_decel_ / kTicAccelPerHz2;
    if (std::abs(left) <= std::max(std::abs(velocity_) * dt_s, 0.5)) {
      place_ = target;
      velocity_ = 0;
      return;
    }
    const double start = std::max(starting_speed_ / kTicSpeedPerHz, std::sqrt(decel));
    const double safe = std::max(std::sqrt(2 * decel * std::abs(left)), start);
    RampTo(std::copysign(std::min(most, safe), left), dt_s);
  }
}

void SimTic::UpdateHoming(double dt_s) {
  const bool active = homing_forward_ ? ForwardLimit() : ReverseLimit();
  const double sense = homing_forward_ ? 1 : -1;
  input_ = Input::velocity;
  switch (homing_) {
    case Homing::off:
      return;
    case Homing::towards:
      input_value_ = static_cast<std::int32_t>(sense * settings_.homing_speed_towards);
      if (!active) return;
      velocity_ = 0;
      input_value_ = 0;
      homing_wait_s_ = kHomingWaitS;
      homing_ = Homing::waiting;
      return;
    case Homing::waiting:
      input_value_ = 0;
      homing_wait_s_ -= dt_s;
      if (homing_wait_s_ <= 0) homing_ = Homing::away;
      return;
    case Homing::away:
      input_value_ = static_cast<std::int32_t>(-sense * settings_.homing_speed_away);
      if (active) return;
      Halt();
      SetPosition(0);
      uncertain_ = false;
      return;
  }
}

void SimTic::Halt() {
  homing_ = Homing::off;
  input_ = Input::halt;
  input_value_ = 0;
  velocity_ = 0;
}

void SimTic::SetPosition(std::int32_t position) {
  place_ = static_cast<double>(std::llround(place_));
  origin_ = std::llround(place_) - position;
}

void SimTic::Obey(TicCommand command, std::uint32_t value) {
  if (EndsCommandTimeout(command)) since_command_s_ = 0;
  const auto number = static_cast<std::int32_t>(value);
  const auto take = [&](Input input) {
    homing_ = Homing::off;
    input_ = input;
    input_value_ = number;
  };
  switch (command) {
    case TicCommand::set_target_position:
      return take(Input::position);
    case TicCommand::set_target_velocity:
      return take(Input::velocity);
    case TicCommand::halt_and_set_position:
      Halt();
      SetPosition(number);
      uncertain_ = false;
      return;
    case TicCommand::halt_and_hold:
      Halt();
      uncertain_ = true;
      return;
    case TicCommand::go_home:
      uncertain_ = true;
      homing_forward_ = value == 1;
      homing_ = Homing::towards;
      return;
    case TicCommand::exit_safe_start:
      safe_start_open_s_ = kSafeStartOpenS;
      return;
    case TicCommand::energize:
      deenergized_ = false;
      return;
    case TicCommand::deenergize:
      deenergized_ = true;
      return;
    case TicCommand::clear_driver_error:
      overheated_ = false;
      return;
    case TicCommand::set_step_mode:
      if (TicMicrosteps(static_cast<std::uint8_t>(value)) <= options_.most_microsteps) {
        step_mode_ = static_cast<std::uint8_t>(value);
      }
      return;
    case TicCommand::set_max_speed:
      max_speed_ = value;
      return;
    case TicCommand::set_starting_speed:
      starting_speed_ = value;
      return;
    case TicCommand::set_max_accel:
      max_accel_ = value;
      return;
    case TicCommand::set_max_decel:
      max_decel_ = value == 0 ? max_accel_ : value;
      return;
    case TicCommand::reinitialize:
      LoadSettings();
      return;
    default:
      return;
  }
}

bool SimTic::Write(const UsbControl& control, std::span<const std::byte>) {
  std::lock_guard lock(mutex_);
  Advance();
  if (control.request_type != 0x40) return false;
  const auto command = static_cast<TicCommand>(control.request);
  if (command == TicCommand::set_setting) {
    ++settings_written_;
    if (control.index >= memory_.size()) return false;
    if (options_.keeps_settings) memory_[control.index] = std::byte(control.value & 0xff);
    return true;
  }
  switch (command) {
    case TicCommand::get_variable:
    case TicCommand::get_setting:
      return false;
    default:
      Obey(command, control.value | static_cast<std::uint32_t>(control.index) << 16);
      Advance();
      return true;
  }
}

bool SimTic::Read(const UsbControl& control, std::span<std::byte> data) {
  std::lock_guard lock(mutex_);
  Advance();
  if (control.request_type != 0xc0 || data.empty() || data.size() > 128) return false;
  const auto answer = [&](std::span<const std::byte> block) {
    for (std::size_t k = 0; k < data.size(); ++k) {
      const std::size_t at = control.index + k;
      data[k] = at < block.size() ? block[at] : std::byte{0};
    }
    return true;
  };
  switch (static_cast<TicCommand>(control.request)) {
    case TicCommand::get_variable:
      return answer(EncodeTicVariables(Variables()));
    case TicCommand::get_setting:
      return answer(memory_);
    default:
      return false;
  }
}

TicVariables SimTic::Variables() const {
  TicVariables v;
  v.state = state_;
  v.energized = (errors_ & (kHard | Bit(TicError::deenergized))) == 0;
  v.position_uncertain = uncertain_;
  v.forward_limit = ForwardLimit();
  v.reverse_limit = ReverseLimit();
  v.homing = homing_ != Homing::off;
  v.errors = errors_;
  v.target_position = input_ == Input::position ? input_value_ : 0;
  v.target_velocity = input_ == Input::velocity ? input_value_ : 0;
  v.starting_speed = starting_speed_;
  v.max_speed = max_speed_;
  v.max_decel = max_decel_;
  v.max_accel = max_accel_;
  v.position = static_cast<std::int32_t>(std::llround(place_) - origin_);
  v.velocity = static_cast<std::int32_t>(std::llround(velocity_ * kTicSpeedPerHz));
  v.vin_mv = supplied_ ? 12'000 : 0;
  v.up_time_ms = static_cast<std::uint32_t>(now_ns_ / 1'000'000);
  v.step_mode = step_mode_;
  return v;
}

void SimTic::PressKillSwitch(bool pressed) {
  std::lock_guard lock(mutex_);
  Advance();
  kill_ = pressed;
}

void SimTic::SupplyMotor(bool on) {
  std::lock_guard lock(mutex_);
  Advance();
  supplied_ = on;
}

void SimTic::OverheatDriver() {
  std::lock_guard lock(mutex_);
  Advance();
  overheated_ = true;
}

void SimTic::ForceLimits(std::optional<bool> active) {
  std::lock_guard lock(mutex_);
  Advance();
  forced_limits_ = active;
}

void SimTic::PowerCycle() {
  std::lock_guard lock(mutex_);
  Advance();
  Halt();
  SetPosition(0);
  uncertain_ = true;
  deenergized_ = overheated_ = false;
  state_ = TicState::reset;
  since_command_s_ = 0;
  step_mode_ = 0;
  LoadSettings();
}

std::int64_t SimTic::place() const {
  std::lock_guard lock(mutex_);
  return std::llround(place_);
}
bool SimTic::energized() const {
  std::lock_guard lock(mutex_);
  return !deenergized_ && supplied_ && !overheated_;
}
int SimTic::settings_written() const {
  std::lock_guard lock(mutex_);
  return settings_written_;
}
TicSettings SimTic::settings() const {
  std::lock_guard lock(mutex_);
  return settings_;
}

}  // namespace scan
