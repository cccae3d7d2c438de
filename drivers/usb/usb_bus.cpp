#include "drivers/usb/usb_bus.h"

#include <fmt/format.h>

#include <algorithm>

namespace scan {

std::string Describe(const UsbIdentity& identity) {
  std::string text = fmt::format("{:04x}:{:04x}", identity.vendor, identity.product);
  if (!identity.name.empty()) text += fmt::format(" '{}'", identity.name);
  text += " at port " + identity.port;
  if (!identity.serial.empty()) text += ", serial " + identity.serial;
  return text;
}

bool Fits(const UsbSelector& selector, const UsbIdentity& identity) {
  const auto& products = selector.products;
  return (selector.vendor == 0 || selector.vendor == identity.vendor) &&
         (products.empty() ||
          std::find(products.begin(), products.end(), identity.product) != products.end()) &&
         (selector.port.empty() || selector.port == identity.port) &&
         (selector.serial.empty() || selector.serial == identity.serial);
}

Result<UsbIdentity> FindUsb(std::span<const UsbIdentity> devices, const UsbSelector& selector,
                            std::string_view what) {
  std::string wanted(what);
  if (!selector.serial.empty())
    wanted += fmt::format(" with the serial number {}", selector.serial);
  if (!selector.port.empty()) wanted += " at port " + selector.port;
  const UsbIdentity* found = nullptr;
  std::string others;
  for (const UsbIdentity& device : devices) {
    if (Fits(selector, device)) {
      if (found) {
        return BadInput(fmt::format("several devices are a {}", wanted),
                        fmt::format("USB ports {}, {}", found->port, device.port),
                        "name the port, or the serial number, of the one that is meant");
      }
      found = &device;
    } else if (Fits({selector.vendor, selector.products, "", ""}, device)) {
      others += (others.empty() ? "" : "; ") + Describe(device);
    }
  }
  if (found) return *found;
  return DeviceFault(fmt::format("there is no {}", wanted), "USB",
                     others.empty() ? "plug it in, and see that its hub has power"
                                    : "plug it in, or name another; there is: " + others);
}

}  // namespace scan
