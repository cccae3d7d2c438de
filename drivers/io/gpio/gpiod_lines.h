// GPIO lines of the kernel through libgpiod, whichever of its two interfaces is installed.
#pragma once

#include "drivers/io/gpio/gpio_lines.h"

namespace scan {

// Finds the chip by label and the lines by name, never by the chip's number, which changes.
// Errors: device, saying what is not there, in use, or not permitted.
Result<std::unique_ptr<GpioLines>> OpenGpiodLines(const GpioRequest& request);

// Every chip that this user can open. Thread contract: any thread.
std::vector<GpioChipInfo> ListGpiodChips();

// "1.6.3" or "2.2.1".
std::string GpiodVersion();

}  // namespace scan
