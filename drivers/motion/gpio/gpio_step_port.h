// A step/direction driver on GPIO lines.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/base/clock.h"
#include "drivers/io/gpio/gpio_lines.h"
#include "drivers/motion/gpio/gpio_motion_config.h"
#include "drivers/motion/gpio/input_watch.h"
#include "drivers/motion/step_port.h"

namespace scan {

// Holds the direction's set-up and hold times and the width of pulses; pulses are emitted whole or
// not at all. The motor is without current and a brake holds until the axis is enabled; when the
// port goes, a brake falls in and the lines are left to the kernel.
class GpioStepPort final : public StepPort {
 public:
  struct Switches {
    std::shared_ptr<InputWatch> watch;
    std::optional<std::size_t> endstop, index;  // places among its inputs
  };
  // Errors: as the opener's.
  static Result<std::unique_ptr<GpioStepPort>> Open(const GpioOpener& open, const std::string& chip,
                                                    const std::string& axis,
                                                    const GpioAxisWiring& wiring, Switches switches,
                                                    std::shared_ptr<Clock> clock);
  ~GpioStepPort() override;

  Status Enable(bool on) override;
  Status Brake(bool on) override;
  Status SetDirection(bool positive) override;
  Status EmitEdge(std::int64_t deadline_ns) override;
  Result<bool> Endstop() override;
  Result<bool> Index() override;

 private:
  GpioStepPort() = default;
  Status SetControl(std::optional<std::size_t> line, bool active);
  Result<bool> Switch(std::optional<std::size_t> input, const char* kind);

  std::string axis_;
  GpioAxisWiring wiring_;
  Switches switches_;
  std::shared_ptr<Clock> clock_;
  std::unique_ptr<GpioLines> step_;     // alone: one call a level
  std::unique_ptr<GpioLines> control_;  // direction, enable, brake
  std::optional<std::size_t> enable_line_, brake_line_;
  std::optional<bool> positive_;
  std::optional<bool> enabled_ = false;  // nothing: a call failed, the line may have either level
  std::optional<bool> braked_ = true;
  std::int64_t settled_ns_ = 0;  // no step before: direction, current, low time of the last pulse
  std::int64_t hold_ns_ = 0;     // no change of direction before
};

}  // namespace scan
