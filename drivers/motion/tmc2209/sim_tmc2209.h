// The simulated twins of up to four TMC2209 on one line: in memory, and behind a pseudo-terminal.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "drivers/base/unique_fd.h"
#include "drivers/motion/tmc2209/serial_port.h"
#include "drivers/motion/tmc2209/tmc2209_protocol.h"

namespace scan {

// One wire: every byte comes back as an echo, replies follow. Thread contract: any thread.
class SimTmc2209Line {
 public:
  explicit SimTmc2209Line(int drivers = 2);

  // A step as its STEP pin sees it; without a set-up, as after power-up, 8 microsteps by the pins.
  void Step(int address, bool positive);
  // Power went and came: registers as after power-up, the position in the turn forgotten.
  void Reset(int address);
  void SetStatus(int address, std::uint32_t drv_status);
  std::uint32_t Register(int address, TmcRegister reg) const;
  // Faults of the wire. From now on the N-th request is not answered; 0: none.
  void LoseReply(std::int64_t nth, bool all_after = false);
  void DamageReply(std::int64_t nth, bool all_after = false);
  std::int64_t requests() const;

  // What the drivers and the wire make of bytes that the computer sends.
  std::vector<std::uint8_t> Exchange(std::span<const std::uint8_t> sent);

 private:
  struct Driver {
    bool there = false;
    std::uint32_t gconf = 0x101, gstat = 1, ifcnt = 0, ihold_irun = 0, chopconf = 0x10000053,
                  drv_status = 0x80000000, tcoolthrs = 0, sgthrs = 0, nodeconf = 0;
    std::int64_t mscnt = 0;
  };
  struct Fault {
    std::int64_t nth = 0;
    bool all_after = false;
    bool Hits(std::int64_t request) const {
      return nth > 0 && (all_after ? request >= nth : request == nth);
    }
  };
  std::vector<std::uint8_t> Answer(std::span<const std::uint8_t> request);
  void Accept(Driver& driver, std::uint8_t reg, std::uint32_t value);
  static std::optional<std::uint32_t> Value(const Driver& driver, std::uint8_t reg);

  mutable std::mutex mutex_;
  std::array<Driver, kTmcMaxAddresses> drivers_;
  std::vector<std::uint8_t> received_;
  Fault lost_, damaged_;
  std::int64_t requests_ = 0;
};

// Opens any path as the line in memory.
SerialOpener OpenerOf(std::shared_ptr<SimTmc2209Line> line);

// The line behind a pseudo-terminal, for programs that open a file.
class PtyTmc2209 {
 public:
  explicit PtyTmc2209(std::shared_ptr<SimTmc2209Line> line);
  const std::string& path() const { return path_; }  // empty: there are no pseudo-terminals here

 private:
  void Run(std::stop_token stop);

  std::shared_ptr<SimTmc2209Line> line_;
  UniqueFd master_, held_;
  std::string path_;
  std::jthread thread_;  // last: it uses all of the above
};

}  // namespace scan
