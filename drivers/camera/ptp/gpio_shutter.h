// Wired release and flash contact on GPIO lines, through an optocoupler each.
#pragma once

#include <memory>

#include "drivers/camera/ptp/ptp_config.h"
#include "drivers/camera/ptp/shutter_lines.h"
#include "drivers/io/gpio/gpio_lines.h"

namespace scan {

// Takes the lines that the configuration names; null where it names none. The release contact is
// open from then on, and when the lines are given back. Errors: those of `open`.
Result<std::unique_ptr<ShutterLines>> OpenGpioShutter(const PtpConfig& config,
                                                      const GpioOpener& open);

}  // namespace scan
