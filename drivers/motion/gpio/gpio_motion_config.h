// How the motors and switches of a station are wired to GPIO lines.
#pragma once

#include <string>
#include <string_view>

#include "drivers/base/result.h"
#include "drivers/io/gpio/gpio_lines.h"
#include "drivers/motion/real_time.h"

namespace scan {

// A line and its sense, written "GPIO17", "!GPIO27" (active low), "^GPIO22" (pull-up),
// "~GPIO22" (pull-down), "^!GPIO22" (both); empty: there is none.
struct GpioPin {
  std::string name;
  bool active_low = false;
  GpioBias bias = GpioBias::as_is;
  explicit operator bool() const { return !name.empty(); }
  friend bool operator==(const GpioPin&, const GpioPin&) = default;
};

// Errors: bad_input for marks without a name, or marks twice.
Result<GpioPin> ParseGpioPin(std::string_view text);

struct GpioAxisWiring {
  GpioPin step, direction;  // a step on the active edge; active direction counts up
  GpioPin enable;           // active: motor current on; may be none
  GpioPin brake;            // active: the brake holds; may be none
  GpioPin endstop, index;   // the one that homing looks for must be there
  double pulse_us = 3;      // a step's active time, and the least inactive time
  double setup_us = 20;     // direction before a step, and after it
  double enable_ms = 2;     // from current on to the first step
  friend bool operator==(const GpioAxisWiring&, const GpioAxisWiring&) = default;
};

struct GpioMotionConfig {
  std::string chip;        // label ("pinctrl-rp1"); empty: the chip that has these line names
  GpioPin emergency_stop;  // active: power is cut; a normally closed contact with a pull-up also
                           // reads so when its wire breaks
  GpioPin cover;           // active: open
  RealTimeOptions real_time;
  GpioAxisWiring turntable, lift;
  friend bool operator==(const GpioMotionConfig&, const GpioMotionConfig&) = default;
};

}  // namespace scan
