// USB devices behind one interface: the kernel's bus (libusb) and its simulated twin.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/base/result.h"

namespace scan {

// What is known of a device without opening it. `port` is where it is plugged in ("1-2.3": bus 1,
// the third socket of a hub in socket 2), as the kernel names it: it stays the same when the device
// is unplugged and plugged in again, and two equal devices never share it.
struct UsbIdentity {
  std::uint16_t vendor = 0, product = 0;
  std::uint16_t release = 0;  // bcdDevice: of its firmware, usually; 0x0106 is 1.06
  std::string port;
  std::string serial, name;  // empty where it has none
  int bus = 0, address = 0;  // of this plugging only
  friend bool operator==(const UsbIdentity&, const UsbIdentity&) = default;
};

// "1ffb:00b3 'Tic T825' at port 1-2.3, serial 00123"
std::string Describe(const UsbIdentity& identity);

// Which device is meant. What is empty or 0 fits every device.
struct UsbSelector {
  std::uint16_t vendor = 0;
  std::vector<std::uint16_t> products;
  std::string port, serial;
};
bool Fits(const UsbSelector& selector, const UsbIdentity& identity);

// The only device that fits. Errors: device when there is none, bad_input when there are several.
// `what` names the kind of device in errors ("Tic board").
Result<UsbIdentity> FindUsb(std::span<const UsbIdentity> devices, const UsbSelector& selector,
                            std::string_view what);

// The setup packet of a control transfer to the device (USB 2.0, 9.3).
struct UsbControl {
  std::uint8_t request_type = 0x40;  // 0x40: vendor, to the device; 0xC0: vendor, from it
  std::uint8_t request = 0;
  std::uint16_t value = 0, index = 0;
  friend bool operator==(const UsbControl&, const UsbControl&) = default;
};

// An open device; nobody else of this machine has it open through this interface.
// Errors: device faults, with what to do about them; once it was unplugged every call fails.
// Thread contract: any thread.
class UsbDevice {
 public:
  virtual ~UsbDevice() = default;
  virtual const UsbIdentity& identity() const = 0;
  virtual Status Write(const UsbControl& control, std::span<const std::byte> data) = 0;
  // Fills all of `data`; an answer that is shorter is a fault.
  virtual Status Read(const UsbControl& control, std::span<std::byte> data) = 0;
  // As if unplugged and plugged in again, but without losing the power. The last step of recovery.
  virtual Status Reset() = 0;
};

struct UsbEvent {
  bool arrived = false;  // else it has left
  UsbIdentity identity;
};

// Stops watching when it dies.
class UsbWatch {
 public:
  virtual ~UsbWatch() = default;
};

// Thread contract: any thread. Watchers are called on a thread of the bus and must not wait.
class UsbBus {
 public:
  virtual ~UsbBus() = default;
  virtual Result<std::vector<UsbIdentity>> List() = 0;
  // The device that is at that port now, if it has the same vendor, product and serial number.
  // Errors: device when it is not there, not permitted, or held by another program.
  virtual Result<std::unique_ptr<UsbDevice>> Open(const UsbIdentity& identity) = 0;
  // Tells of the devices that are there, then of every one that comes or goes.
  virtual Result<std::unique_ptr<UsbWatch>> Watch(std::function<void(const UsbEvent&)> tell) = 0;
};

}  // namespace scan
