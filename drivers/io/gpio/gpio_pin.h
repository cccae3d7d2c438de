// How a station file writes one GPIO line.
#pragma once

#include <string>
#include <string_view>

#include "drivers/base/result.h"
#include "drivers/io/gpio/gpio_lines.h"

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

}  // namespace scan
