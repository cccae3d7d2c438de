// Up to four TMC2209 on one serial line.
#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "drivers/base/result.h"
#include "drivers/motion/tmc2209/serial_port.h"
#include "drivers/motion/tmc2209/tmc2209_protocol.h"

namespace scan {

// Both directions share one wire, so every request comes back as an echo, which is dropped. A
// request that stays without a good answer is repeated twice.
// Thread contract: any thread; one request at a time. Errors: device, naming line and address.
class Tmc2209Bus {
 public:
  // Tells all drivers of the line to answer late enough for more than one to share it.
  static Result<std::shared_ptr<Tmc2209Bus>> Open(const SerialOpener& open,
                                                  const std::string& path);

  Result<std::uint32_t> Read(int address, TmcRegister reg);
  // Good when the driver's own counter of accepted writes (IFCNT) went up by one.
  Status Write(int address, TmcRegister reg, std::uint32_t value);

 private:
  Tmc2209Bus(std::unique_ptr<SerialPort> port, std::string path)
      : port_(std::move(port)), path_(std::move(path)) {}
  std::string Where(int address) const;
  Result<std::uint32_t> ReadLocked(int address, TmcRegister reg);
  Status Send(std::span<const std::uint8_t> request);

  std::mutex mutex_;
  std::unique_ptr<SerialPort> port_;
  const std::string path_;
};

// What a driver says of itself.
struct Tmc2209State {
  int version = 0;  // 0x21
  TmcFlags flags;
  std::int64_t mscnt = 0;  // 0 to 1023
  int current_scale = 0;   // CS that flows now
  bool standstill = false;
};
Result<Tmc2209State> ReadTmc2209(Tmc2209Bus& bus, int address);

// Writes the set-up, reads back what can be read, clears the flags; then the driver is as asked.
// Errors: device, also for a chip that is no TMC2209; bad_input as ValidateTmc2209.
Result<TmcCurrents> SetUpTmc2209(Tmc2209Bus& bus, const Tmc2209Config& config);

// Whether a stall drives the pin DIAG (StallGuard4), for homing without a switch.
Status ShowStalls(Tmc2209Bus& bus, const Tmc2209Config& config, bool on);

}  // namespace scan
