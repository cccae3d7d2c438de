// Whether this user may open USB devices.
#pragma once

#include <string>

#include "drivers/usb/usb_bus.h"

namespace scan {

// The kernel's node of a device: /dev/bus/usb/001/005.
std::string UsbNode(const UsbIdentity& identity);
// Errors: device, with the mending of a missing udev rule.
Status CheckUsbAccess(const UsbIdentity& identity);

// What to do where the kernel refuses a device to this user.
inline constexpr const char* kUsbAccessMend =
    "copy udev/60-scanstation.rules to /etc/udev/rules.d, run 'udevadm control --reload', add this "
    "user to the group plugdev, log in anew and plug the device in again";

}  // namespace scan
