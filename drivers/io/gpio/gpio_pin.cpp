#include "drivers/io/gpio/gpio_pin.h"

#include <fmt/format.h>

namespace scan {

Result<GpioPin> ParseGpioPin(std::string_view text) {
  GpioPin pin;
  std::string_view rest = text;
  if (rest.starts_with('^') || rest.starts_with('~')) {
    pin.bias = rest.front() == '^' ? GpioBias::pull_up : GpioBias::pull_down;
    rest.remove_prefix(1);
  }
  if (rest.starts_with('!')) {
    pin.active_low = true;
    rest.remove_prefix(1);
  }
  pin.name = rest;
  const bool marks_left = rest.find_first_of("^~! \t") != std::string_view::npos;
  if (marks_left || (rest.empty() && !text.empty())) {
    return BadInput(fmt::format("'{}' is no line", text), "gpio",
                    "write NAME, !NAME (active low), ^NAME (pull-up), ~NAME (pull-down), ^!NAME");
  }
  return pin;
}

}  // namespace scan
