// What the owners of camera workers share.
#pragma once

#include <chrono>

#include "drivers/base/result.h"
#include "drivers/usb/usb_bus.h"

namespace scan {

// A configured time, rounded.
std::chrono::milliseconds WholeMs(double ms);

// Resets the camera that `selector` names, as unplugging it would. Errors: as FindUsb, UsbBus::Open
// and UsbDevice::Reset.
Status ResetUsbCamera(const UsbSelector& selector);

}  // namespace scan
