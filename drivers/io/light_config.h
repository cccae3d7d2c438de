// The station's lamp, as its file says it.
#pragma once

#include <string>

#include "drivers/io/gpio/gpio_pin.h"

namespace scan {

enum class LightDriver { none, gpio, pwm };

constexpr double kMaxSettleMs = 60'000;

struct LightConfig {
  LightDriver driver = LightDriver::none;
  std::string chip;         // gpio: label, empty: the one that has the line; pwm: its device's name
  GpioPin line;             // gpio
  int channel = 0;          // pwm
  bool active_low = false;  // pwm: the lamp is lit while the output is low
  double period_us = 100;   // pwm
  double level = 1;         // brightness when it is on, above 0 to 1
  double settle_ms = 200;   // from on to the first exposure
  friend bool operator==(const LightConfig&, const LightConfig&) = default;
};

}  // namespace scan
