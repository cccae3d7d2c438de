// Datagrams and registers of the TMC2209.
// Source: TMC2209 datasheet, Rev. 1.09, sections 4 (UART), 5 (registers), 9 (currents).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "drivers/base/result.h"
#include "drivers/motion/tmc2209/tmc2209_config.h"

namespace scan {

constexpr int kTmcMaxAddresses = 4;
constexpr std::uint8_t kTmcSync = 0x05;      // first byte of every datagram
constexpr std::uint8_t kTmcWriteBit = 0x80;  // of the register's byte
constexpr std::int64_t kTmcCounts = 1024;    // of MSCNT, in one turn of the current: 4 full steps

enum class TmcRegister : std::uint8_t {
  gconf = 0x00,
  gstat = 0x01,
  ifcnt = 0x02,
  nodeconf = 0x03,
  ioin = 0x06,
  ihold_irun = 0x10,
  tpowerdown = 0x11,
  tcoolthrs = 0x14,
  sgthrs = 0x40,
  mscnt = 0x6a,
  chopconf = 0x6c,
  drv_status = 0x6f,
};

// Polynomial x^8 + x^2 + x + 1, each byte from its lowest bit (section 4.2).
std::uint8_t TmcCrc(std::span<const std::uint8_t> bytes);
std::array<std::uint8_t, 4> TmcReadRequest(int address, TmcRegister reg);
std::array<std::uint8_t, 8> TmcWriteRequest(int address, TmcRegister reg, std::uint32_t value);
// The value of a reply; nothing when it is not one to this register, or damaged.
std::optional<std::uint32_t> TmcReplyValue(std::span<const std::uint8_t> reply, TmcRegister reg);
std::array<std::uint8_t, 8> TmcReply(TmcRegister reg, std::uint32_t value);

// Current scales of IHOLD_IRUN and the range of the sense voltage that goes with them.
struct TmcCurrents {
  int run = 0, hold = 0;   // CS, 0 to 31
  bool low_range = false;  // CHOPCONF.vsense: 0.18 V instead of 0.325 V
  double run_ma = 0;       // what the scales give, RMS
  friend bool operator==(const TmcCurrents&, const TmcCurrents&) = default;
};
// The largest scales that are not a thousandth above what is asked for, in the lower range where
// that reaches. Errors: bad_input for a current that the driver cannot give with this resistor.
Result<TmcCurrents> TmcCurrentsOf(const Tmc2209Config& config);

// Register values of a set-up. Precondition: `config` is valid.
std::uint32_t TmcGconf(const Tmc2209Config& config);
std::uint32_t TmcChopconf(const Tmc2209Config& config, const TmcCurrents& currents);
std::uint32_t TmcIholdIrun(const TmcCurrents& currents);

// GSTAT and DRV_STATUS in words.
struct TmcFlags {
  bool reset = false;         // has started anew: the set-up is lost
  bool driver_error = false;  // switched its outputs off since the flags were cleared
  bool undervoltage = false;  // of the charge pump: outputs off
  bool overtemperature = false;
  bool hot = false;  // warns of it
  bool short_circuit = false;
  bool open_load = false;  // also seen without fault at rest or at speed (section 5.5.3)
  friend bool operator==(const TmcFlags&, const TmcFlags&) = default;
};
TmcFlags TmcFlagsOf(std::uint32_t gstat, std::uint32_t drv_status);
// Those that cost the position, "short circuit, overtemperature"; empty when none is up.
std::string TmcFaultWords(const TmcFlags& flags);

// Errors: bad_input with the key ("microsteps") in `where`.
Status ValidateTmc2209(const Tmc2209Config& config);

}  // namespace scan
