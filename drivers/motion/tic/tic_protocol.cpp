#include "drivers/motion/tic/tic_protocol.h"

#include <fmt/format.h>

#include <bit>

namespace scan {
namespace {

// Offsets of variables (0J71, section 7) and settings (section 6); little endian.
enum Variable : std::size_t {
  kOperationState = 0x00,
  kMiscFlags = 0x01,
  kErrorStatus = 0x02,
  kErrorsOccurred = 0x04,
  kTargetPosition = 0x0a,
  kTargetVelocity = 0x0e,
  kStartingSpeed = 0x12,
  kMaxSpeed = 0x16,
  kMaxDecel = 0x1a,
  kMaxAccel = 0x1e,
  kCurrentPosition = 0x22,
  kCurrentVelocity = 0x26,
  kDeviceReset = 0x32,
  kVinVoltage = 0x33,
  kUpTime = 0x35,
  kStepMode = 0x49
};
enum Setting : std::size_t {
  kControlMode = 0x01,
  kCommandTimeout = 0x09,
  kSoftErrorResponse = 0x53,
  kForwardLimitMap = 0x5f,
  kReverseLimitMap = 0x60,
  kHomingTowards = 0x61,
  kHomingAway = 0x65
};
enum MiscFlag : unsigned {
  kEnergized = 1,
  kUncertain = 2,
  kForwardLimit = 4,
  kReverseLimit = 8,
  kHoming = 16
};

template <class T>
T Get(std::span<const std::byte> block, std::size_t offset) {
  std::uint32_t value = 0;
  for (std::size_t k = sizeof(T); k-- > 0;) {
    value = (value << 8) | std::to_integer<std::uint32_t>(block[offset + k]);
  }
  return static_cast<T>(value);
}

template <class T>
void Put(std::span<std::byte> block, std::size_t offset, T value) {
  auto rest = static_cast<std::uint32_t>(value);
  for (std::size_t k = 0; k < sizeof(T); ++k, rest >>= 8)
    block[offset + k] = std::byte(rest & 0xff);
}

struct ErrorRow {
  TicError error;
  std::string_view name, mend;
};
// In the order of what weighs most.
constexpr std::array<ErrorRow, 9> kErrors{{
    {TicError::motor_driver, "motor driver error",
     "let the board cool, check the motor's wiring and the current limit, then home again"},
    {TicError::low_vin, "low VIN", "switch the motor supply on and check its voltage and fuse"},
    {TicError::kill_switch, "kill switch", "release the emergency stop, then home again"},
    {TicError::err_line, "ERR line high", "mend the board whose ERR line is wired to this one"},
    {TicError::input_invalid, "required input invalid",
     "set the control mode to 'Serial / I2C / USB' with Pololu's Tic Control Center"},
    {TicError::serial, "serial error", "leave the board's serial lines unconnected"},
    {TicError::command_timeout, "command timeout",
     "the program did not speak to the board in time: check the cable and the load of this "
     "machine"},
    {TicError::safe_start, "safe start violation", "home again"},
    {TicError::deenergized, "de-energized", "home again"},
}};

}  // namespace

const TicModel* FindTicModel(std::uint16_t vendor, std::uint16_t product) {
  for (const TicModel& model : kTicModels) {
    if (vendor == kPololuVendor && product == model.product) return &model;
  }
  return nullptr;
}

UsbSelector TicSelector(const std::string& port, const std::string& serial) {
  UsbSelector selector{kPololuVendor, {}, port, serial};
  for (const TicModel& model : kTicModels) selector.products.push_back(model.product);
  return selector;
}

UsbControl EncodeTic(TicCommand command, std::int32_t value) {
  const auto bits = static_cast<std::uint32_t>(value);
  return {0x40, static_cast<std::uint8_t>(command), static_cast<std::uint16_t>(bits & 0xffff),
          static_cast<std::uint16_t>(bits >> 16)};
}

UsbControl EncodeTicRead(TicCommand command, std::uint8_t offset) {
  return {0xc0, static_cast<std::uint8_t>(command), 0, offset};
}

UsbControl EncodeTicSetting(std::uint8_t offset, std::uint8_t value) {
  return {0x40, static_cast<std::uint8_t>(TicCommand::set_setting), value, offset};
}

Result<std::uint8_t> TicStepMode(int microsteps) {
  if (microsteps >= 1 && microsteps <= 256 && std::has_single_bit(unsigned(microsteps))) {
    const int power = std::countr_zero(unsigned(microsteps));
    return static_cast<std::uint8_t>(power <= 5 ? power : power + 1);  // 6 is 2 at 100 % current
  }
  return BadInput(fmt::format("{} microsteps", microsteps), "microsteps",
                  "choose 1, 2, 4, 8, 16, 32, 64, 128 or 256");
}

int TicMicrosteps(std::uint8_t step_mode) {
  if (step_mode <= 5) return 1 << step_mode;
  return step_mode >= 7 && step_mode <= 9 ? 1 << (step_mode - 1) : 0;
}

std::string TicErrorWords(std::uint16_t errors) {
  std::string words;
  for (const ErrorRow& row : kErrors) {
    if (!(errors & Bit(row.error))) continue;
    if (!words.empty()) words += ", ";
    words += row.name;
  }
  if (words.empty() && errors != 0) words = fmt::format("error status {:#06x}", errors);
  return words;
}

std::string TicErrorMend(std::uint16_t errors) {
  for (const ErrorRow& row : kErrors) {
    if (errors & Bit(row.error)) return std::string(row.mend);
  }
  return "look at the board with Pololu's Tic Control Center";
}

std::string_view NameOf(TicState state) {
  switch (state) {
    case TicState::reset:
      return "reset";
    case TicState::deenergized:
      return "de-energized";
    case TicState::soft_error:
      return "soft error";
    case TicState::waiting_for_err_line:
      return "waiting for ERR line";
    case TicState::starting_up:
      return "starting up";
    case TicState::normal:
      return "normal";
  }
  return "unknown";
}

TicVariables DecodeTicVariables(std::span<const std::byte, kTicVariablesSize> block) {
  TicVariables v;
  v.state = static_cast<TicState>(Get<std::uint8_t>(block, kOperationState));
  const unsigned flags = Get<std::uint8_t>(block, kMiscFlags);
  v.energized = (flags & kEnergized) != 0;
  v.position_uncertain = (flags & kUncertain) != 0;
  v.forward_limit = (flags & kForwardLimit) != 0;
  v.reverse_limit = (flags & kReverseLimit) != 0;
  v.homing = (flags & kHoming) != 0;
  v.errors = Get<std::uint16_t>(block, kErrorStatus);
  v.errors_occurred = Get<std::uint32_t>(block, kErrorsOccurred);
  v.target_position = Get<std::int32_t>(block, kTargetPosition);
  v.target_velocity = Get<std::int32_t>(block, kTargetVelocity);
  v.starting_speed = Get<std::uint32_t>(block, kStartingSpeed);
  v.max_speed = Get<std::uint32_t>(block, kMaxSpeed);
  v.max_decel = Get<std::uint32_t>(block, kMaxDecel);
  v.max_accel = Get<std::uint32_t>(block, kMaxAccel);
  v.position = Get<std::int32_t>(block, kCurrentPosition);
  v.velocity = Get<std::int32_t>(block, kCurrentVelocity);
  v.device_reset = Get<std::uint8_t>(block, kDeviceReset);
  v.vin_mv = Get<std::uint16_t>(block, kVinVoltage);
  v.up_time_ms = Get<std::uint32_t>(block, kUpTime);
  v.step_mode = Get<std::uint8_t>(block, kStepMode);
  return v;
}

TicVariablesBlock EncodeTicVariables(const TicVariables& v) {
  TicVariablesBlock block{};
  Put(block, kOperationState, static_cast<std::uint8_t>(v.state));
  Put(block, kMiscFlags,
      static_cast<std::uint8_t>(
          (v.energized ? kEnergized : 0U) | (v.position_uncertain ? kUncertain : 0U) |
          (v.forward_limit ? kForwardLimit : 0U) | (v.reverse_limit ? kReverseLimit : 0U) |
          (v.homing ? kHoming : 0U)));
  Put(block, kErrorStatus, v.errors);
  Put(block, kErrorsOccurred, v.errors_occurred);
  Put(block, kTargetPosition, v.target_position);
  Put(block, kTargetVelocity, v.target_velocity);
  Put(block, kStartingSpeed, v.starting_speed);
  Put(block, kMaxSpeed, v.max_speed);
  Put(block, kMaxDecel, v.max_decel);
  Put(block, kMaxAccel, v.max_accel);
  Put(block, kCurrentPosition, v.position);
  Put(block, kCurrentVelocity, v.velocity);
  Put(block, kDeviceReset, v.device_reset);
  Put(block, kVinVoltage, v.vin_mv);
  Put(block, kUpTime, v.up_time_ms);
  Put(block, kStepMode, v.step_mode);
  return block;
}

TicSettings DecodeTicSettings(std::span<const std::byte, kTicSettingsSize> block) {
  TicSettings s;
  s.control_mode = Get<std::uint8_t>(block, kControlMode);
  s.command_timeout_ms = Get<std::uint16_t>(block, kCommandTimeout);
  s.soft_error_response = Get<std::uint8_t>(block, kSoftErrorResponse);
  s.forward_limit_pins = Get<std::uint8_t>(block, kForwardLimitMap);
  s.reverse_limit_pins = Get<std::uint8_t>(block, kReverseLimitMap);
  s.homing_speed_towards = Get<std::uint32_t>(block, kHomingTowards);
  s.homing_speed_away = Get<std::uint32_t>(block, kHomingAway);
  return s;
}

void EncodeTicSettings(const TicSettings& s, std::span<std::byte, kTicSettingsSize> block) {
  Put(block, kControlMode, s.control_mode);
  Put(block, kCommandTimeout, s.command_timeout_ms);
  Put(block, kSoftErrorResponse, s.soft_error_response);
  Put(block, kForwardLimitMap, s.forward_limit_pins);
  Put(block, kReverseLimitMap, s.reverse_limit_pins);
  Put(block, kHomingTowards, s.homing_speed_towards);
  Put(block, kHomingAway, s.homing_speed_away);
}

}  // namespace scan
