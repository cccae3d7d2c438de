// A lamp whose brightness is the duty cycle of a PWM output.
#pragma once

#include <memory>

#include "drivers/base/clock.h"
#include "drivers/io/lamp.h"
#include "drivers/io/light_config.h"
#include "drivers/io/pwm/pwm_files.h"

namespace scan {

// The chip whose device has the name `device`. Errors: device, naming those that are there.
Result<PwmChip> FindPwmChip(PwmFiles& files, const std::string& device);

// Exports the channel where nobody has, sets period and darkness, then enables it. It stays enabled
// with a duty cycle of nothing when the lamp goes: a disabled output has no defined level.
// `clock` times the wait for the rights that udev gives to an exported channel (1 s at most).
// Errors: device, bad_input for a channel that the chip does not have.
Result<std::unique_ptr<Lamp>> OpenPwmLamp(const LightConfig& config,
                                          std::shared_ptr<PwmFiles> files,
                                          std::shared_ptr<Clock> clock);

}  // namespace scan
