// A lamp that a GPIO line switches.
#pragma once

#include <memory>

#include "drivers/io/gpio/gpio_pin.h"
#include "drivers/io/lamp.h"

namespace scan {

// Takes the line of `pin` on the chip labelled `chip` (empty: the one that has it). The lamp knows
// the levels 0 and 1 only. Errors: as the opener's.
Result<std::unique_ptr<Lamp>> OpenGpioLamp(const GpioOpener& open, const std::string& chip,
                                           const GpioPin& pin);

}  // namespace scan
