#include "drivers/usb/libusb_bus.h"

#include <fmt/format.h>
#include <libusb.h>

#include <array>
#include <fstream>
#include <map>
#include <thread>

#include "drivers/base/clock.h"
#include "drivers/usb/usb_access.h"

namespace scan {
namespace {

constexpr unsigned kTimeoutMs = 1600;  // a device may write its settings before it answers
constexpr std::int64_t kPollNs = 1'000'000'000;  // of the list, where libusb cannot watch

std::string MendOf(int code) {
  switch (code) {
    case LIBUSB_ERROR_ACCESS:
      return kUsbAccessMend;
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
      return "it was unplugged or has lost its power: check the cable and the hub, plug it in "
             "again";
    case LIBUSB_ERROR_BUSY:
      return "another program has it: end that program (scanstation-motiond, the maker's own tool)";
    case LIBUSB_ERROR_PIPE:
      return "it does not know this request: check its model and its firmware";
    case LIBUSB_ERROR_TIMEOUT:
      return "it does not answer: unplug it, wait a moment, plug it in again";
    default:
      return "check the cable and the hub; plug it in again";
  }
}

tl::unexpected<Error> UsbFault(int code, const std::string& doing, const UsbIdentity& identity) {
  return DeviceFault(fmt::format("{}: {}", doing, libusb_strerror(code)), Describe(identity),
                     MendOf(code));
}

class Context {
 public:
  static Result<std::shared_ptr<Context>> Make() {
    auto made = std::make_shared<Context>();
    if (const int code = libusb_init(&made->context_); code != 0) {
      made->context_ = nullptr;
      return DeviceFault(fmt::format("libusb does not start: {}", libusb_strerror(code)), "USB",
                         "check that /dev/bus/usb is there");
    }
    return made;
  }
  Context() = default;
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  ~Context() {
    if (context_) libusb_exit(context_);
  }
  libusb_context* get() const { return context_; }

 private:
  libusb_context* context_ = nullptr;
};

std::string PortOf(libusb_device* device) {
  std::array<std::uint8_t, 8> ports{};
  const int count = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  const int bus = libusb_get_bus_number(device);
  if (count <= 0) return fmt::format("usb{}", bus);  // a root hub, as the kernel names it
  std::string port = fmt::format("{}-{}", bus, ports[0]);
  for (int k = 1; k < count; ++k) port += fmt::format(".{}", ports[static_cast<std::size_t>(k)]);
  return port;
}

std::string FromSysfs(const std::string& port, const char* attribute) {
  std::ifstream in(fmt::format("/sys/bus/usb/devices/{}/{}", port, attribute));
  std::string line;
  std::getline(in, line);
  return line;
}

// A descriptor that cannot be read gives an identity without ids, which fits nothing.
UsbIdentity IdentityOf(libusb_device* device) {
  UsbIdentity identity;
  libusb_device_descriptor descriptor{};
  if (libusb_get_device_descriptor(device, &descriptor) == 0) {
    identity.vendor = descriptor.idVendor;
    identity.product = descriptor.idProduct;
    identity.release = descriptor.bcdDevice;
  }
  identity.port = PortOf(device);
  identity.bus = libusb_get_bus_number(device);
  identity.address = libusb_get_device_address(device);
  identity.serial = FromSysfs(identity.port, "serial");
  identity.name = FromSysfs(identity.port, "product");
  return identity;
}

class LibusbDevice final : public UsbDevice {
 public:
  LibusbDevice(std::shared_ptr<Context> context, libusb_device_handle* handle, UsbIdentity identity)
      : context_(std::move(context)), handle_(handle), identity_(std::move(identity)) {}
  LibusbDevice(const LibusbDevice&) = delete;
  LibusbDevice& operator=(const LibusbDevice&) = delete;
  ~LibusbDevice() override {
    libusb_release_interface(handle_, 0);
    libusb_close(handle_);
  }
  const UsbIdentity& identity() const override { return identity_; }

  Status Write(const UsbControl& control, std::span<const std::byte> data) override {
    std::vector<std::byte> copy(data.begin(), data.end());  // libusb's buffer is not const
    SCAN_CHECK(Transfer(control, copy, "writing"));
    return {};
  }
  Status Read(const UsbControl& control, std::span<std::byte> data) override {
    SCAN_TRY(const std::size_t got, Transfer(control, data, "reading"));
    if (got == data.size()) return {};
    return DeviceFault(
        fmt::format("it answered {} bytes where {} were asked for", got, data.size()),
        Describe(identity_), "check its model and its firmware");
  }
  Status Reset() override {
    const int code = libusb_reset_device(handle_);
    if (code == 0 && libusb_claim_interface(handle_, 0) == 0) return {};
    return UsbFault(code == 0 ? LIBUSB_ERROR_BUSY : code, "reset", identity_);
  }

 private:
  Result<std::size_t> Transfer(const UsbControl& control, std::span<std::byte> data,
                               const char* doing) {
    const int got =
        libusb_control_transfer(handle_, control.request_type, control.request, control.value,
                                control.index, reinterpret_cast<unsigned char*>(data.data()),
                                static_cast<std::uint16_t>(data.size()), kTimeoutMs);
    if (got < 0) return UsbFault(got, fmt::format("{} {:#04x}", doing, control.request), identity_);
    return static_cast<std::size_t>(got);
  }

  std::shared_ptr<Context> context_;
  libusb_device_handle* handle_;
  UsbIdentity identity_;
};

class DeviceList {
 public:
  explicit DeviceList(libusb_context* context) : count_(libusb_get_device_list(context, &list_)) {}
  DeviceList(const DeviceList&) = delete;
  DeviceList& operator=(const DeviceList&) = delete;
  ~DeviceList() {
    if (count_ >= 0) libusb_free_device_list(list_, 1);
  }
  Status Check() const {
    if (count_ >= 0) return {};
    return DeviceFault(fmt::format("no list: {}", libusb_strerror(static_cast<int>(count_))), "USB",
                       "check that /dev/bus/usb and /sys/bus/usb are there");
  }
  std::span<libusb_device* const> devices() const {
    return {list_, static_cast<std::size_t>(std::max<ssize_t>(count_, 0))};
  }

 private:
  libusb_device** list_ = nullptr;
  ssize_t count_;
};

Result<std::vector<UsbIdentity>> ListDevices(const Context& context) {
  const DeviceList list(context.get());
  SCAN_CHECK(list.Check());
  std::vector<UsbIdentity> identities;
  for (libusb_device* device : list.devices()) identities.push_back(IdentityOf(device));
  return identities;
}

// By libusb's own events. A device that leaves has no sysfs entries any more: what was known of it
// when it came is told again.
class HotplugWatch final : public UsbWatch {
 public:
  HotplugWatch(std::shared_ptr<Context> context, std::function<void(const UsbEvent&)> tell)
      : context_(std::move(context)), tell_(std::move(tell)) {}
  Status Start() {
    const auto code = libusb_hotplug_register_callback(
        context_->get(), LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED | LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT,
        LIBUSB_HOTPLUG_ENUMERATE, LIBUSB_HOTPLUG_MATCH_ANY, LIBUSB_HOTPLUG_MATCH_ANY,
        LIBUSB_HOTPLUG_MATCH_ANY, &HotplugWatch::OnEvent, this, &callback_);
    if (code != 0) {
      return DeviceFault(fmt::format("hot-plug watch: {}", libusb_strerror(code)), "USB",
                         "check that /dev/bus/usb and udev are there");
    }
    thread_ = std::jthread([this](std::stop_token stop) {
      while (!stop.stop_requested()) {
        timeval wait{0, 200'000};
        libusb_handle_events_timeout_completed(context_->get(), &wait, nullptr);
      }
    });
    return {};
  }
  ~HotplugWatch() override {
    thread_.request_stop();
    libusb_interrupt_event_handler(context_->get());
    if (thread_.joinable()) thread_.join();
    libusb_hotplug_deregister_callback(context_->get(), callback_);
  }

 private:
  static int LIBUSB_CALL OnEvent(libusb_context*, libusb_device* device, libusb_hotplug_event event,
                                 void* user) {
    auto& self = *static_cast<HotplugWatch*>(user);
    const bool arrived = event == LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED;
    UsbIdentity identity = IdentityOf(device);
    const auto known = self.known_.find({identity.bus, identity.address});
    if (!arrived && known != self.known_.end()) identity = known->second;
    if (arrived) {
      self.known_[{identity.bus, identity.address}] = identity;
    } else if (known != self.known_.end()) {
      self.known_.erase(known);
    }
    self.tell_({arrived, identity});
    return 0;
  }

  std::shared_ptr<Context> context_;
  std::function<void(const UsbEvent&)> tell_;
  std::map<std::pair<int, int>, UsbIdentity> known_;  // by bus and address; only in OnEvent
  libusb_hotplug_callback_handle callback_ = 0;
  std::jthread thread_;
};

// By asking, where libusb was built without events.
class PollingWatch final : public UsbWatch {
 public:
  PollingWatch(std::shared_ptr<Context> context, std::function<void(const UsbEvent&)> tell)
      : thread_([context = std::move(context), tell = std::move(tell)](std::stop_token stop) {
          std::map<std::pair<int, int>, UsbIdentity> known;
          SystemClock clock;
          do {
            const auto list = ListDevices(*context);
            if (!list) continue;
            std::map<std::pair<int, int>, UsbIdentity> now;
            for (const UsbIdentity& identity : *list)
              now[{identity.bus, identity.address}] = identity;
            for (const auto& [key, identity] : known)
              if (!now.contains(key)) tell({false, identity});
            for (const auto& [key, identity] : now)
              if (!known.contains(key)) tell({true, identity});
            known = std::move(now);
          } while (clock.SleepFor(kPollNs, stop));
        }) {}

 private:
  std::jthread thread_;
};

// A context hears of devices that come later from udev alone, which containers and small systems
// may lack: each call looks anew, with a context of its own.
class LibusbBus final : public UsbBus {
 public:
  Result<std::vector<UsbIdentity>> List() override {
    SCAN_TRY(const auto context, Context::Make());
    return ListDevices(*context);
  }

  Result<std::unique_ptr<UsbDevice>> Open(const UsbIdentity& wanted) override {
    SCAN_TRY(const auto context, Context::Make());
    const DeviceList list(context->get());
    SCAN_CHECK(list.Check());
    for (libusb_device* device : list.devices()) {
      UsbIdentity identity = IdentityOf(device);
      if (identity.port != wanted.port || identity.vendor != wanted.vendor ||
          identity.product != wanted.product || identity.serial != wanted.serial) {
        continue;
      }
      libusb_device_handle* handle = nullptr;
      if (const int code = libusb_open(device, &handle); code != 0) {
        return UsbFault(code, "open", identity);
      }
      auto opened = std::make_unique<LibusbDevice>(context, handle, identity);
      if (const int code = libusb_claim_interface(handle, 0); code != 0) {
        return UsbFault(code, "claim", identity);
      }
      return opened;
    }
    return UsbFault(LIBUSB_ERROR_NO_DEVICE, "open", wanted);
  }

  Result<std::unique_ptr<UsbWatch>> Watch(std::function<void(const UsbEvent&)> tell) override {
    SCAN_TRY(auto own, Context::Make());  // its events are handled by its own thread
    if (!libusb_has_capability(LIBUSB_CAP_HAS_HOTPLUG)) {
      return std::make_unique<PollingWatch>(std::move(own), std::move(tell));
    }
    auto watch = std::make_unique<HotplugWatch>(std::move(own), std::move(tell));
    SCAN_CHECK(watch->Start());
    return watch;
  }
};

}  // namespace

Result<std::unique_ptr<UsbBus>> MakeLibusbBus() {
  SCAN_CHECK(Context::Make());  // so that a missing bus is found at once
  return std::make_unique<LibusbBus>();
}

}  // namespace scan
