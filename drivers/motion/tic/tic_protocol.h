// The control transfers of Pololu Tic stepper controllers, as numbers: nothing here talks to one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "drivers/base/result.h"
#include "drivers/usb/usb_bus.h"

// Source: Pololu, Tic Stepper Motor Controller User's Guide (pololu.com/docs/0J71), sections 6 to 8
// and 11. Positions are in microsteps, speeds in microsteps per 10000 s, accelerations in
// microsteps/s per 100 s.
namespace scan {

inline constexpr std::uint16_t kPololuVendor = 0x1ffb;
inline constexpr std::uint16_t kTicLeastFirmware = 0x0106;  // limit switches and homing

struct TicModel {
  std::uint16_t product;
  std::string_view name;
  int most_microsteps;  // per full step
};
inline constexpr std::array<TicModel, 5> kTicModels{{{0x00b3, "Tic T825", 32},
                                                     {0x00b5, "Tic T834", 32},
                                                     {0x00bd, "Tic T500", 8},
                                                     {0x00c9, "Tic T249", 32},
                                                     {0x00cb, "Tic 36v4", 256}}};
// Null for what is no Tic.
const TicModel* FindTicModel(std::uint16_t vendor, std::uint16_t product);
// Of any Tic; empty texts fit every one.
UsbSelector TicSelector(const std::string& port, const std::string& serial);

// Quick commands and writes.
enum class TicCommand : std::uint8_t {
  exit_safe_start = 0x83,
  energize = 0x85,
  deenergize = 0x86,
  halt_and_hold = 0x89,
  clear_driver_error = 0x8a,
  reset_command_timeout = 0x8c,
  set_step_mode = 0x94,
  go_home = 0x97,
  get_variable = 0xa1,
  get_setting = 0xa8,
  set_target_position = 0xe0,
  set_target_velocity = 0xe3,
  set_starting_speed = 0xe5,
  set_max_speed = 0xe6,
  set_max_decel = 0xe9,
  set_max_accel = 0xea,
  halt_and_set_position = 0xec,
  set_setting = 0x13,
  reinitialize = 0x10
};

inline constexpr double kTicSpeedPerHz = 10'000, kTicAccelPerHz2 = 100;
inline constexpr double kTicMaxSpeedHz = 50'000;
inline constexpr double kTicMinAccelHz2 = 1, kTicMaxAccelHz2 = 21'474'836;

// A command without data or with a signed 32-bit value (low half in wValue, high half in wIndex).
UsbControl EncodeTic(TicCommand command, std::int32_t value = 0);
// A block read of variables or settings. Precondition: at most 128 bytes are read.
UsbControl EncodeTicRead(TicCommand command, std::uint8_t offset);
// One byte of the board's permanent memory (100,000 writes): only where it differs.
UsbControl EncodeTicSetting(std::uint8_t offset, std::uint8_t value);

// Step mode codes: 1 2 4 8 16 32 microsteps are 0 to 5, 64 128 256 are 7 to 9.
// Errors: bad_input for another number.
Result<std::uint8_t> TicStepMode(int microsteps);
// 0 for a mode that is not a power of two.
int TicMicrosteps(std::uint8_t step_mode);

// Errors that stop the motor, by bit of the error status.
enum class TicError {
  deenergized,
  motor_driver,
  low_vin,
  kill_switch,
  input_invalid,
  serial,
  command_timeout,
  safe_start,
  err_line
};
constexpr std::uint16_t Bit(TicError error) {
  return static_cast<std::uint16_t>(1U << static_cast<unsigned>(error));
}
// "low VIN, command timeout"; empty for 0. Mend: of the first one, in the order of what weighs
// most.
std::string TicErrorWords(std::uint16_t errors);
std::string TicErrorMend(std::uint16_t errors);

enum class TicState : std::uint8_t {
  reset = 0,
  deenergized = 2,
  soft_error = 4,
  waiting_for_err_line = 6,
  starting_up = 8,
  normal = 10
};
std::string_view NameOf(TicState state);

struct TicVariables {
  TicState state = TicState::reset;
  bool energized = false, position_uncertain = false;
  bool forward_limit = false, reverse_limit = false, homing = false;
  std::uint16_t errors = 0;           // what stops the motor now, by TicError
  std::uint32_t errors_occurred = 0;  // since last cleared
  std::int32_t target_position = 0;
  std::int32_t target_velocity = 0;
  std::uint32_t starting_speed = 0, max_speed = 0, max_decel = 0, max_accel = 0;
  std::int32_t position = 0;
  std::int32_t velocity = 0;
  std::uint8_t device_reset = 0;
  std::uint16_t vin_mv = 0;
  std::uint32_t up_time_ms = 0;
  std::uint8_t step_mode = 0;
  friend bool operator==(const TicVariables&, const TicVariables&) = default;
};
inline constexpr std::size_t kTicVariablesSize = 0x55;  // what every model has
using TicVariablesBlock = std::array<std::byte, kTicVariablesSize>;
TicVariables DecodeTicVariables(std::span<const std::byte, kTicVariablesSize> block);
// For the simulated board.
TicVariablesBlock EncodeTicVariables(const TicVariables& variables);

// What matters here of the permanent settings.
struct TicSettings {
  std::uint8_t control_mode = 0;  // 0: serial, I2C, USB
  std::uint16_t command_timeout_ms = 1000;
  std::uint8_t soft_error_response =
      2;  // 0 no current, 1 halt, 2 ramp down and hold, 3 go somewhere
  std::uint8_t forward_limit_pins = 0, reverse_limit_pins = 0;  // bits: SCL SDA TX RX RC
  std::uint32_t homing_speed_towards = 1'000'000, homing_speed_away = 1'000'000;
  friend bool operator==(const TicSettings&, const TicSettings&) = default;
};
inline constexpr std::size_t kTicSettingsSize = 0x69;  // byte 0 is not read
using TicSettingsBlock = std::array<std::byte, kTicSettingsSize>;
TicSettings DecodeTicSettings(std::span<const std::byte, kTicSettingsSize> block);
// Puts them into a block read before, whose other bytes stay.
void EncodeTicSettings(const TicSettings& settings, std::span<std::byte, kTicSettingsSize> block);

}  // namespace scan
