// A Tic board's simulated twin, behind the control transfers it answers.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "drivers/base/clock.h"
#include "drivers/motion/tic/tic_protocol.h"
#include "drivers/usb/sim_usb_bus.h"

namespace scan {

// Moves its motor along trapezoidal ramps as time goes by on the clock, from one transfer to the
// next. What the firmware does about errors, safe start, command timeout, limit switches and homing
// is as Pololu's guide describes it (0J71, sections 5.4 and 5.6). Thread contract: any thread.
class SimTic final : public SimUsbFunction {
 public:
  struct Options {
    std::shared_ptr<Clock> clock;
    TicSettings settings;
    // The motor's true place, in microsteps; a limit switch is active beyond its edge.
    std::int64_t start = 0;
    std::optional<std::int64_t> forward_edge, reverse_edge;
    int most_microsteps = 32;
    bool keeps_settings = true;  // false: its permanent memory is worn out
  };
  explicit SimTic(Options options);

  bool Write(const UsbControl& control, std::span<const std::byte> data) override;
  bool Read(const UsbControl& control, std::span<std::byte> data) override;

  // From outside the USB bus.
  void PressKillSwitch(bool pressed);
  void SupplyMotor(bool on);
  void OverheatDriver();
  void ForceLimits(std::optional<bool> active);  // a switch that is stuck or disconnected
  void PowerCycle();
  std::int64_t place() const;  // the motor's true place now
  bool energized() const;
  int settings_written() const;
  TicSettings settings() const;

 private:
  enum class Input { halt, position, velocity };
  enum class Homing { off, towards, waiting, away };

  void Advance();
  void Step(double dt_s);
  void UpdateErrors();
  void UpdateVelocity(double dt_s);
  void RampTo(double goal, double dt_s);
  void UpdateHoming(double dt_s);
  bool Normal() const { return state_ == TicState::normal; }
  bool ForwardLimit() const;
  bool ReverseLimit() const;
  void Halt();
  void SetPosition(std::int32_t position);
  void LoadSettings();
  void Obey(TicCommand command, std::uint32_t value);
  TicVariables Variables() const;

  Options options_;
  mutable std::mutex mutex_;
  std::int64_t now_ns_;
  TicSettingsBlock memory_{};
  TicSettings settings_;
  int settings_written_ = 0;

  TicState state_ = TicState::reset;
  std::uint16_t errors_ = 0;
  bool deenergized_ = false, kill_ = false, supplied_ = true, overheated_ = false;
  bool uncertain_ = true;
  std::optional<bool> forced_limits_;
  double since_command_s_ = 0, safe_start_open_s_ = 0, starting_s_ = 0;

  double place_ = 0;         // true, microsteps
  std::int64_t origin_ = 0;  // place of position 0
  double velocity_ = 0;      // microsteps/s
  Input input_ = Input::halt;
  std::int32_t input_value_ = 0;
  Homing homing_ = Homing::off;
  bool homing_forward_ = false;
  double homing_wait_s_ = 0;
  std::uint32_t max_speed_ = 2'000'000, starting_speed_ = 0;
  std::uint32_t max_accel_ = 40'000, max_decel_ = 40'000;
  std::uint8_t step_mode_ = 0;
};

}  // namespace scan
