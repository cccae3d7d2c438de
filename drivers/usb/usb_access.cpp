#include "drivers/usb/usb_access.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace scan {

std::string UsbNode(const UsbIdentity& identity) {
  return fmt::format("/dev/bus/usb/{:03d}/{:03d}", identity.bus, identity.address);
}

Status CheckUsbAccess(const UsbIdentity& identity) {
  const std::string node = UsbNode(identity);
  if (access(node.c_str(), R_OK | W_OK) == 0) return {};
  const int error = errno;
  return DeviceFault(std::strerror(error), fmt::format("{} ({})", Describe(identity), node),
                     error == EACCES ? kUsbAccessMend : "plug it in again");
}

}  // namespace scan
