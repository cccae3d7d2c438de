// A machine whose only USB devices are simulated ones, down to the kernel's interface: libusb sees
// them in sysfs and talks to them through usbfs ioctls. Only inside umockdev's environment.
#pragma once

#include <memory>
#include <string>

#include "drivers/usb/sim_usb_bus.h"

namespace scan {

class UsbMock {
 public:
  UsbMock();  // a root hub and a hub at port 1-2
  ~UsbMock();
  UsbMock(const UsbMock&) = delete;
  UsbMock& operator=(const UsbMock&) = delete;

  // Full speed, one vendor specific interface. Bus 1; `identity.address` is taken as it is.
  void Plug(const UsbIdentity& identity, std::shared_ptr<SimUsbFunction> function);
  void Unplug(const std::string& port);
  // From now on transfers of the device at that port end with this errno of the kernel; 0: none.
  void FailWith(const std::string& port, int urb_errno);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace scan
