#include "firmware-host/devices/worker_recovery.h"

#include <cmath>

#include "drivers/usb/libusb_bus.h"

namespace scan {

std::chrono::milliseconds WholeMs(double ms) { return std::chrono::milliseconds(std::llround(ms)); }

Status ResetUsbCamera(const UsbSelector& selector) {
  SCAN_TRY(const auto bus, MakeLibusbBus());
  SCAN_TRY(const auto devices, bus->List());
  SCAN_TRY(const UsbIdentity identity, FindUsb(devices, selector, "camera"));
  SCAN_TRY(const auto device, bus->Open(identity));
  return device->Reset();
}

}  // namespace scan
