// The USB bus' simulated twin: devices are plugged in and out by a test.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "drivers/usb/usb_bus.h"

namespace scan {

// What a simulated device does with control transfers. Called with the bus' lock held.
class SimUsbFunction {
 public:
  virtual ~SimUsbFunction() = default;
  // False: stalled, the request is not known.
  virtual bool Write(const UsbControl& control, std::span<const std::byte> data) = 0;
  virtual bool Read(const UsbControl& control, std::span<std::byte> data) = 0;
  virtual void Reset() {}
};

// Outlives the devices it opened. Thread contract: any thread.
class SimUsbBus final : public UsbBus, public std::enable_shared_from_this<SimUsbBus> {
 public:
  // Replaces what is at that port. Bus and address are the bus' own choice.
  void Plug(UsbIdentity identity, std::shared_ptr<SimUsbFunction> function);
  void Unplug(const std::string& port);
  // The N-th transfer from now fails; 0: none. With `unplugs` its device leaves the bus.
  void FailAt(std::int64_t nth, bool unplugs = false);
  std::int64_t transfers() const;

  Result<std::vector<UsbIdentity>> List() override;
  Result<std::unique_ptr<UsbDevice>> Open(const UsbIdentity& identity) override;
  // Watchers are called on the thread that plugs.
  Result<std::unique_ptr<UsbWatch>> Watch(std::function<void(const UsbEvent&)> tell) override;

 private:
  friend class SimUsbDevice;
  friend class SimUsbWatch;
  struct Socket {
    UsbIdentity identity;
    std::shared_ptr<SimUsbFunction> function;
    bool held = false;
  };
  // The socket of an open device, or why the transfer fails. Precondition: locked.
  Result<Socket*> Transfer(const UsbIdentity& identity);
  void Tell(const UsbEvent& event);

  mutable std::mutex mutex_;
  std::map<std::string, Socket> sockets_;  // by port
  std::mutex watch_mutex_;                 // of the watchers; never taken after mutex_
  std::map<int, std::function<void(const UsbEvent&)>> watchers_;
  int next_watcher_ = 0;
  int next_address_ = 2;
  std::int64_t transfers_ = 0;
  std::int64_t fail_at_ = 0;
  bool fail_unplugs_ = false;
};

}  // namespace scan
