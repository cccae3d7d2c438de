#include "drivers/usb/sim_usb_bus.h"

namespace scan {
namespace {

constexpr const char* kPlugIn = "it was unplugged: plug it in again";

}  // namespace

class SimUsbDevice final : public UsbDevice {
 public:
  SimUsbDevice(std::shared_ptr<SimUsbBus> bus, UsbIdentity identity)
      : bus_(std::move(bus)), identity_(std::move(identity)) {}
  SimUsbDevice(const SimUsbDevice&) = delete;
  SimUsbDevice& operator=(const SimUsbDevice&) = delete;
  ~SimUsbDevice() override {
    std::lock_guard lock(bus_->mutex_);
    const auto at = bus_->sockets_.find(identity_.port);
    if (at != bus_->sockets_.end() && at->second.identity == identity_) at->second.held = false;
  }
  const UsbIdentity& identity() const override { return identity_; }
  Status Write(const UsbControl& control, std::span<const std::byte> data) override {
    std::lock_guard lock(bus_->mutex_);
    SCAN_TRY(SimUsbBus::Socket * socket, bus_->Transfer(identity_));
    return Answer(socket->function->Write(control, data));
  }
  Status Read(const UsbControl& control, std::span<std::byte> data) override {
    std::lock_guard lock(bus_->mutex_);
    SCAN_TRY(SimUsbBus::Socket * socket, bus_->Transfer(identity_));
    return Answer(socket->function->Read(control, data));
  }
  Status Reset() override {
    std::lock_guard lock(bus_->mutex_);
    SCAN_TRY(SimUsbBus::Socket * socket, bus_->Transfer(identity_));
    socket->function->Reset();
    return {};
  }

 private:
  Status Answer(bool known) const {
    if (known) return {};
    return DeviceFault("the request was stalled", Describe(identity_),
                       "it does not know this request: check its model and its firmware");
  }
  std::shared_ptr<SimUsbBus> bus_;
  UsbIdentity identity_;
};

class SimUsbWatch final : public UsbWatch {
 public:
  SimUsbWatch(std::shared_ptr<SimUsbBus> bus, int number) : bus_(std::move(bus)), number_(number) {}
  SimUsbWatch(const SimUsbWatch&) = delete;
  SimUsbWatch& operator=(const SimUsbWatch&) = delete;
  ~SimUsbWatch() override {
    std::lock_guard lock(bus_->watch_mutex_);
    bus_->watchers_.erase(number_);
  }

 private:
  std::shared_ptr<SimUsbBus> bus_;
  int number_;
};

void SimUsbBus::Plug(UsbIdentity identity, std::shared_ptr<SimUsbFunction> function) {
  Unplug(identity.port);
  {
    std::lock_guard lock(mutex_);
    identity.bus = 1;
    identity.address = next_address_++;
    sockets_[identity.port] = {identity, std::move(function), false};
  }
  Tell({true, identity});
}

void SimUsbBus::Unplug(const std::string& port) {
  UsbIdentity left;
  {
    std::lock_guard lock(mutex_);
    const auto at = sockets_.find(port);
    if (at == sockets_.end()) return;
    left = at->second.identity;
    sockets_.erase(at);
  }
  Tell({false, left});
}

void SimUsbBus::FailAt(std::int64_t nth, bool unplugs) {
  std::lock_guard lock(mutex_);
  fail_at_ = nth > 0 ? transfers_ + nth : 0;
  fail_unplugs_ = unplugs;
}

std::int64_t SimUsbBus::transfers() const {
  std::lock_guard lock(mutex_);
  return transfers_;
}

void SimUsbBus::Tell(const UsbEvent& event) {
  std::lock_guard lock(watch_mutex_);
  for (const auto& [number, tell] : watchers_) tell(event);
}

Result<SimUsbBus::Socket*> SimUsbBus::Transfer(const UsbIdentity& identity) {
  const auto at = sockets_.find(identity.port);
  if (at == sockets_.end() || !(at->second.identity == identity)) {
    return DeviceFault("no such device", Describe(identity), kPlugIn);
  }
  if (++transfers_ == fail_at_) {
    if (fail_unplugs_) sockets_.erase(at);
    return DeviceFault("simulated fault of the transfer", Describe(identity),
                       "check the cable and the hub; plug it in again");
  }
  return &at->second;
}

Result<std::vector<UsbIdentity>> SimUsbBus::List() {
  std::lock_guard lock(mutex_);
  std::vector<UsbIdentity> identities;
  for (const auto& [port, socket] : sockets_) identities.push_back(socket.identity);
  return identities;
}

Result<std::unique_ptr<UsbDevice>> SimUsbBus::Open(const UsbIdentity& wanted) {
  std::lock_guard lock(mutex_);
  const auto at = sockets_.find(wanted.port);
  if (at == sockets_.end() || at->second.identity.vendor != wanted.vendor ||
      at->second.identity.product != wanted.product ||
      at->second.identity.serial != wanted.serial) {
    return DeviceFault("no such device", Describe(wanted), kPlugIn);
  }
  if (at->second.held) {
    return DeviceFault("another program has it", Describe(wanted), "end that program");
  }
  at->second.held = true;
  return std::make_unique<SimUsbDevice>(shared_from_this(), at->second.identity);
}

Result<std::unique_ptr<UsbWatch>> SimUsbBus::Watch(std::function<void(const UsbEvent&)> tell) {
  SCAN_TRY(const auto there, List());
  std::lock_guard lock(watch_mutex_);
  for (const UsbIdentity& identity : there) tell({true, identity});
  watchers_[next_watcher_] = std::move(tell);
  return std::make_unique<SimUsbWatch>(shared_from_this(), next_watcher_++);
}

}  // namespace scan
