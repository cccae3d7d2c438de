#include "firmware-host/devices/open_motion.h"

#include "drivers/base/clock.h"
#include "drivers/io/gpio/gpiod_lines.h"
#include "drivers/motion/gpio/gpio_motion.h"
#include "drivers/motion/real_time.h"
#include "drivers/motion/tic/tic_motion.h"
#include "drivers/station/sim_station.h"
#include "drivers/usb/libusb_bus.h"

namespace scan {

Result<std::unique_ptr<Motion>> OpenMotion(const StationConfig& config) {
  std::vector<std::string> aim_ids;
  for (const AimConfig& aim : config.aims) aim_ids.push_back(aim.id);
  switch (config.motion_driver) {
    case MotionDriver::gpio:
      return MakeGpioMotion({config.turntable, config.lift, config.gpio, aim_ids}, OpenGpiodLines,
                            std::make_shared<RealTimeClock>());
    case MotionDriver::tic: {
      SCAN_TRY(std::shared_ptr<UsbBus> bus, MakeLibusbBus());
      return MakeTicMotion({config.turntable, config.lift, config.tic, aim_ids}, bus,
                           std::make_shared<SystemClock>());
    }
    case MotionDriver::sim:
      break;
  }
  return MakeSimMotion(config, std::make_shared<SimWorld>(config), std::make_shared<SystemClock>());
}

}  // namespace scan
