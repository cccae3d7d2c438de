#include "tests/unit/usb/usb_mock.h"

#include <fmt/format.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <umockdev.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <deque>
#include <map>
#include <stdexcept>
#include <vector>

namespace scan {
namespace {

constexpr const char* kController = "/devices/pci0000:00/0000:00:14.0/usb1";

std::string Hex(const std::vector<unsigned>& bytes) {
  std::string text;
  for (const unsigned byte : bytes) text += fmt::format("{:02X}", byte);
  return text;
}

// Device, configuration and interface descriptors (USB 2.0, 9.6).
std::string Descriptors(const UsbIdentity& id, unsigned device_class, unsigned interface_class) {
  const auto low = [](unsigned v) { return v & 0xff; };
  const auto high = [](unsigned v) { return v >> 8; };
  return Hex({18,
              1,
              0,
              2,
              device_class,
              0,
              0,
              64,
              low(id.vendor),
              high(id.vendor),
              low(id.product),
              high(id.product),
              low(id.release),
              high(id.release),
              1,
              2,
              3,
              1,  //
              9,
              2,
              18,
              0,
              1,
              1,
              0,
              0x80,
              50,  //
              9,
              4,
              0,
              0,
              0,
              interface_class,
              0,
              0,
              0});
}

// Answers the usbfs ioctls of one device. Called by umockdev's thread.
struct Handler {
  std::shared_ptr<SimUsbFunction> function;
  std::atomic<int> fail_with{0};
  std::deque<UMockdevIoctlData*> done;

  ~Handler() {
    for (UMockdevIoctlData* urb : done) umockdev_ioctl_data_unref(urb);
  }

  template <class T>
  static void Set(UMockdevIoctlData* data, std::size_t offset, T value) {
    guint8 bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    umockdev_ioctl_data_update(data, offset, bytes, sizeof(T));
  }
  template <class T>
  static T Get(UMockdevIoctlData* data, std::size_t offset) {
    guint8* bytes = nullptr;
    gint length = 0;
    umockdev_ioctl_data_retrieve(data, &bytes, &length);
    T value{};
    if (static_cast<std::size_t>(length) >= offset + sizeof(T)) {
      std::memcpy(&value, bytes + offset, sizeof(T));
    }
    g_free(bytes);
    return value;
  }

  // A control transfer: the buffer begins with the setup packet.
  void Submit(UMockdevIoctlData* argument) {
    UMockdevIoctlData* urb =
        umockdev_ioctl_data_resolve(argument, 0, sizeof(usbdevfs_urb), nullptr);
    const auto length = Get<int>(urb, offsetof(usbdevfs_urb, buffer_length));
    UMockdevIoctlData* buffer = umockdev_ioctl_data_resolve(urb, offsetof(usbdevfs_urb, buffer),
                                                            static_cast<gsize>(length), nullptr);
    const UsbControl control{Get<std::uint8_t>(buffer, 0), Get<std::uint8_t>(buffer, 1),
                             Get<std::uint16_t>(buffer, 2), Get<std::uint16_t>(buffer, 4)};
    std::vector<std::byte> data(Get<std::uint16_t>(buffer, 6));
    int status = fail_with;
    if (status == 0) {
      const bool in = (control.request_type & 0x80) != 0;
      const bool known = in ? function->Read(control, data) : function->Write(control, data);
      if (!known) status = EPIPE;
      for (std::size_t k = 0; in && known && k < data.size(); ++k) Set(buffer, 8 + k, data[k]);
    }
    Set<int>(urb, offsetof(usbdevfs_urb, status), -status);
    Set<int>(urb, offsetof(usbdevfs_urb, actual_length),
             status == 0 ? static_cast<int>(data.size()) : 0);
    umockdev_ioctl_data_unref(buffer);
    done.push_back(urb);
  }

  static gboolean OnIoctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer user) {
    auto& self = *static_cast<Handler*>(user);
    UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
    switch (umockdev_ioctl_client_get_request(client)) {
      case USBDEVFS_GET_CAPABILITIES: {
        UMockdevIoctlData* value = umockdev_ioctl_data_resolve(argument, 0, 4, nullptr);
        Set<std::uint32_t>(value, 0, 0);
        umockdev_ioctl_data_unref(value);
        umockdev_ioctl_client_complete(client, 0, 0);
        return TRUE;
      }
      case USBDEVFS_CLAIMINTERFACE:
      case USBDEVFS_RELEASEINTERFACE:
      case USBDEVFS_RESET:
      case USBDEVFS_DISCARDURB:
        umockdev_ioctl_client_complete(client, 0, 0);
        return TRUE;
      case USBDEVFS_SUBMITURB:
        if (self.fail_with == ENODEV) {
          umockdev_ioctl_client_complete(client, -1, ENODEV);
          return TRUE;
        }
        self.Submit(argument);
        umockdev_ioctl_client_complete(client, 0, 0);
        return TRUE;
      case USBDEVFS_REAPURB:
      case USBDEVFS_REAPURBNDELAY: {
        if (self.done.empty()) {
          umockdev_ioctl_client_complete(client, -1, EAGAIN);
          return TRUE;
        }
        UMockdevIoctlData* place = umockdev_ioctl_data_resolve(argument, 0, sizeof(void*), nullptr);
        UMockdevIoctlData* urb = self.done.front();
        self.done.pop_front();
        umockdev_ioctl_data_set_ptr(place, 0, urb);
        umockdev_ioctl_client_complete(client, 0, 0);
        umockdev_ioctl_data_unref(urb);
        umockdev_ioctl_data_unref(place);
        return TRUE;
      }
      default:
        umockdev_ioctl_client_complete(client, -1, ENOTTY);
        return TRUE;
    }
  }
};

}  // namespace

struct UsbMock::Impl {
  struct Device {
    std::string path, node;
    std::unique_ptr<Handler> handler;
    UMockdevIoctlBase* ioctls = nullptr;
  };
  UMockdevTestbed* testbed = umockdev_testbed_new();
  std::map<std::string, Device> devices;  // by port

  std::string PathOf(const std::string& port) const {
    std::string path = kController;
    for (std::size_t dot = port.find('.'); dot != std::string::npos;
         dot = port.find('.', dot + 1)) {
      path += "/" + port.substr(0, dot);
    }
    return path + "/" + port;
  }
  void Add(const std::string& path, const UsbIdentity& id, unsigned device_class,
           unsigned interface_class) {
    const std::string node = fmt::format("bus/usb/{:03d}/{:03d}", id.bus, id.address);
    const std::string text = fmt::format(
        "P: {}\nN: {}\nE: BUSNUM={:03d}\nE: DEVNUM={:03d}\nE: DEVNAME=/dev/{}\n"
        "E: DEVTYPE=usb_device\nE: DRIVER=usb\nE: PRODUCT={:x}/{:x}/{:x}\nE: SUBSYSTEM=usb\n"
        "A: busnum={}\\n\nA: devnum={}\\n\nA: bConfigurationValue=1\\n\nA: speed=12\\n\n"
        "A: idVendor={:04x}\\n\nA: idProduct={:04x}\\n\nA: serial={}\\n\nA: product={}\\n\n"
        "H: descriptors={}\n",
        path, node, id.bus, id.address, node, id.vendor, id.product, id.release, id.bus, id.address,
        id.vendor, id.product, id.serial, id.name, Descriptors(id, device_class, interface_class));
    GError* error = nullptr;
    if (!umockdev_testbed_add_from_string(testbed, text.c_str(), &error)) {
      throw std::runtime_error(error->message);
    }
  }
};

UsbMock::UsbMock() : impl_(std::make_unique<Impl>()) {
  impl_->Add(kController, {0x1d6b, 2, 0x0601, "usb1", "0000:00:14.0", "root hub", 1, 1}, 9, 9);
  impl_->Add(impl_->PathOf("1-2"), {0x05e3, 0x0608, 0x0100, "1-2", "", "hub", 1, 2}, 9, 9);
}

UsbMock::~UsbMock() {
  while (!impl_->devices.empty()) Unplug(impl_->devices.begin()->first);
  g_object_unref(impl_->testbed);
}

void UsbMock::Plug(const UsbIdentity& identity, std::shared_ptr<SimUsbFunction> function) {
  Impl::Device device;
  device.path = impl_->PathOf(identity.port);
  device.node = fmt::format("/dev/bus/usb/{:03d}/{:03d}", identity.bus, identity.address);
  device.handler = std::make_unique<Handler>();
  device.handler->function = std::move(function);
  impl_->Add(device.path, identity, 0, 0xff);
  device.ioctls = umockdev_ioctl_base_new();
  g_signal_connect(device.ioctls, "handle-ioctl", G_CALLBACK(&Handler::OnIoctl),
                   device.handler.get());
  GError* error = nullptr;
  if (!umockdev_testbed_attach_ioctl(impl_->testbed, device.node.c_str(), device.ioctls, &error)) {
    throw std::runtime_error(error->message);
  }
  umockdev_testbed_uevent(impl_->testbed, ("/sys" + device.path).c_str(), "add");
  impl_->devices[identity.port] = std::move(device);
}

void UsbMock::Unplug(const std::string& port) {
  const auto at = impl_->devices.find(port);
  if (at == impl_->devices.end()) return;
  at->second.handler->fail_with = ENODEV;
  umockdev_testbed_uevent(impl_->testbed, ("/sys" + at->second.path).c_str(), "remove");
  umockdev_testbed_detach_ioctl(impl_->testbed, at->second.node.c_str(), nullptr);
  umockdev_testbed_remove_device(impl_->testbed, ("/sys" + at->second.path).c_str());
  g_object_unref(at->second.ioctls);
  impl_->devices.erase(at);
}

void UsbMock::FailWith(const std::string& port, int urb_errno) {
  impl_->devices.at(port).handler->fail_with = urb_errno;
}

}  // namespace scan
