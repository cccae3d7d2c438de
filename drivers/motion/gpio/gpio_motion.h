// Turntable and lift on GPIO lines, as one Motion.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/base/clock.h"
#include "drivers/io/gpio/gpio_lines.h"
#include "drivers/motion/axis_config.h"
#include "drivers/motion/gpio/gpio_motion_config.h"
#include "drivers/motion/motion.h"
#include "drivers/motion/step_port.h"

namespace scan {

struct GpioMotionParts {
  AxisConfig turntable, lift;
  GpioMotionConfig gpio;
  std::vector<std::string> aim_ids;  // known by name; the camera is aimed by hand or not at all
  StepPortWrap wrap = {};            // of every axis' port; may be empty
};

// Takes the lines, watches the switches, and plays moves on a real-time thread. Logs what the
// kernel granted and, for each homing and move, how late its steps were. The clock is the system's
// monotonic one; a simulated board may bring another.
// Errors: device faults of the lines, bad_input where an axis has no line for its home switch.
Result<std::unique_ptr<Motion>> MakeGpioMotion(const GpioMotionParts& parts, const GpioOpener& open,
                                               std::shared_ptr<Clock> clock);

}  // namespace scan
