// One Tic board on the USB bus.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "drivers/base/result.h"
#include "drivers/motion/tic/tic_config.h"
#include "drivers/motion/tic/tic_protocol.h"
#include "drivers/usb/usb_bus.h"

namespace scan {

// Keeps to the board that its station file names: after an unplugging it opens the same one again.
// Errors: device faults; a transfer that fails closes the board until Open().
// Thread contract: one thread at a time (the owner locks).
class TicBoard {
 public:
  TicBoard(std::shared_ptr<UsbBus> bus, TicAxisWiring wiring)
      : bus_(std::move(bus)), wiring_(std::move(wiring)) {}

  // Does nothing when it is open. Errors: also firmware without limit switches and homing.
  Status Open();
  bool is_open() const { return device_ != nullptr; }
  // What it is; empty before the first Open().
  const UsbIdentity& identity() const { return identity_; }
  const TicAxisWiring& wiring() const { return wiring_; }

  Status Send(TicCommand command, std::int32_t value = 0);
  Result<TicVariables> ReadVariables();
  Result<TicSettings> ReadSettings();
  // Writes the bytes that differ and lets them take effect. True: there were some.
  // Errors: also when the board does not keep them.
  Result<bool> WriteSettings(const TicSettings& wanted);

 private:
  Result<TicSettingsBlock> ReadSettingsBlock();
  Status Seen(Status status);

  std::shared_ptr<UsbBus> bus_;
  TicAxisWiring wiring_;
  UsbIdentity identity_;
  std::unique_ptr<UsbDevice> device_;
};

}  // namespace scan
