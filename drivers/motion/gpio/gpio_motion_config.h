// How the motors and switches of a station are wired to GPIO lines.
#pragma once

#include <string>

#include "drivers/io/gpio/gpio_pin.h"
#include "drivers/motion/real_time.h"

namespace scan {

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
  GpioPin motor_power;  // active: the motors' supply is there, behind the emergency stop's contact
  double power_off_ms = 500;  // an emergency stop must have cut it within this
  RealTimeOptions real_time;
  GpioAxisWiring turntable, lift;
  friend bool operator==(const GpioMotionConfig&, const GpioMotionConfig&) = default;
};

}  // namespace scan
