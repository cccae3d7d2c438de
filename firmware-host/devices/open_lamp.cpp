#include "firmware-host/devices/open_lamp.h"

#include "drivers/base/clock.h"
#include "drivers/io/gpio/gpio_lamp.h"
#include "drivers/io/gpio/gpiod_lines.h"
#include "drivers/io/pwm/pwm_lamp.h"

namespace scan {

Result<std::unique_ptr<Lamp>> OpenLamp(const StationConfig& config) {
  switch (config.light.driver) {
    case LightDriver::gpio:
      return OpenGpioLamp(OpenGpiodLines, config.light.chip, config.light.line);
    case LightDriver::pwm:
      return OpenPwmLamp(config.light, KernelPwmFiles(), std::make_shared<SystemClock>());
    case LightDriver::none:
      break;
  }
  return std::unique_ptr<Lamp>();
}

}  // namespace scan
