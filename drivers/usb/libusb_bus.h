// The kernel's USB devices, through libusb.
#pragma once

#include <memory>

#include "drivers/usb/usb_bus.h"

namespace scan {

// Names, serial numbers and ports are read from sysfs where it has them: no permission is needed to
// list. Opening claims interface 0, so that a second program is refused instead of mixing in.
// Errors: device when libusb cannot start.
Result<std::unique_ptr<UsbBus>> MakeLibusbBus();

}  // namespace scan
