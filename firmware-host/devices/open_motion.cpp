#include "firmware-host/devices/open_motion.h"

#include "drivers/base/clock.h"
#include "drivers/io/gpio/gpiod_lines.h"
#include "drivers/motion/gpio/gpio_motion.h"
#include "drivers/motion/real_time.h"
#include "drivers/motion/tic/tic_motion.h"
#include "drivers/motion/tmc2209/tmc2209_motion.h"
#include "drivers/station/sim_station.h"
#include "drivers/usb/libusb_bus.h"

namespace scan {

namespace {

Result<std::unique_ptr<Motion>> OpenGpioMotion(const StationConfig& config,
                                               const std::vector<std::string>& aim_ids) {
  const auto make = [&](const StepPortWrap& wrap) {
    return MakeGpioMotion({config.turntable, config.lift, config.gpio, aim_ids, wrap},
                          OpenGpiodLines, std::make_shared<RealTimeClock>());
  };
  if (!HasTmc2209(config.turntable_tmc2209, config.lift_tmc2209)) return make({});
  return MakeTmc2209Motion(config.turntable_tmc2209, config.lift_tmc2209, OpenSerialPort, make);
}

}  // namespace

Result<std::unique_ptr<Motion>> OpenMotion(const StationConfig& config) {
  std::vector<std::string> aim_ids;
  for (const AimConfig& aim : config.aims) aim_ids.push_back(aim.id);
  switch (config.motion_driver) {
    case MotionDriver::gpio:
      return OpenGpioMotion(config, aim_ids);
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
