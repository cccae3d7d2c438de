#include "drivers/motion/tmc2209/tmc2209_protocol.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace scan {
namespace {

constexpr std::uint8_t kMaster = 0xff;
constexpr double kSourceOhm = 0.02;  // of the chip itself, in series with the sense resistor
constexpr double kHighRangeV = 0.325, kLowRangeV = 0.18;

constexpr std::uint32_t Bit(int bit) { return std::uint32_t{1} << bit; }

// Section 9: I_rms = (CS + 1) / 32 * V_fs / (R_sense + 20 mOhm) / sqrt(2).
double CurrentMa(int scale, double range_v, double sense_mohm) {
  return 1e3 * (scale + 1) / 32.0 * range_v / (1e-3 * sense_mohm + kSourceOhm) /
         std::numbers::sqrt2;
}

int ScaleOf(double ma, double range_v, double sense_mohm) {
  const double full_ma = CurrentMa(31, range_v, sense_mohm);
  return static_cast<int>(std::floor(32 * ma / full_ma * (1 + 1e-3))) - 1;
}

void PutValue(std::span<std::uint8_t> bytes, std::uint32_t value) {
  for (int k = 0; k < 4; ++k) {
    bytes[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(value >> (24 - 8 * k));
  }
}

}  // namespace

std::uint8_t TmcCrc(std::span<const std::uint8_t> bytes) {
  unsigned crc = 0;
  for (unsigned byte : bytes) {
    for (int k = 0; k < 8; ++k, byte >>= 1) {
      const bool carry = ((crc >> 7) ^ (byte & 1)) != 0;
      crc = ((crc << 1) & 0xff) ^ (carry ? 0x07U : 0U);
    }
  }
  return static_cast<std::uint8_t>(crc);
}

std::array<std::uint8_t, 4> TmcReadRequest(int address, TmcRegister reg) {
  std::array<std::uint8_t, 4> bytes{kTmcSync, static_cast<std::uint8_t>(address),
                                    static_cast<std::uint8_t>(reg), 0};
  bytes[3] = TmcCrc(std::span(bytes).first(3));
  return bytes;
}

std::array<std::uint8_t, 8> TmcWriteRequest(int address, TmcRegister reg, std::uint32_t value) {
  std::array<std::uint8_t, 8> bytes{
      kTmcSync, static_cast<std::uint8_t>(address),
      static_cast<std::uint8_t>(static_cast<std::uint8_t>(reg) | kTmcWriteBit)};
  PutValue(std::span(bytes).subspan(3, 4), value);
  bytes[7] = TmcCrc(std::span(bytes).first(7));
  return bytes;
}

std::array<std::uint8_t, 8> TmcReply(TmcRegister reg, std::uint32_t value) {
  std::array<std::uint8_t, 8> bytes{kTmcSync, kMaster, static_cast<std::uint8_t>(reg)};
  PutValue(std::span(bytes).subspan(3, 4), value);
  bytes[7] = TmcCrc(std::span(bytes).first(7));
  return bytes;
}

std::optional<std::uint32_t> TmcReplyValue(std::span<const std::uint8_t> reply, TmcRegister reg) {
  if (reply.size() != 8 || reply[0] != kTmcSync || reply[1] != kMaster ||
      reply[2] != static_cast<std::uint8_t>(reg) || reply[7] != TmcCrc(reply.first(7))) {
    return std::nullopt;
  }
  std::uint32_t value = 0;
  for (const std::uint8_t byte : reply.subspan(3, 4)) value = value << 8 | byte;
  return value;
}

Result<TmcCurrents> TmcCurrentsOf(const Tmc2209Config& config) {
  TmcCurrents currents;
  currents.low_range = config.run_ma <= CurrentMa(31, kLowRangeV, config.sense_mohm);
  const double range_v = currents.low_range ? kLowRangeV : kHighRangeV;
  const double most_ma = CurrentMa(31, kHighRangeV, config.sense_mohm);
  const double least_ma = CurrentMa(0, range_v, config.sense_mohm);
  if (config.run_ma > most_ma || config.run_ma < least_ma) {
    return BadInput(
        fmt::format("{} mA are outside the {:.0f} to {:.0f} mA that {} mOhm give", config.run_ma,
                    CurrentMa(0, kLowRangeV, config.sense_mohm), most_ma, config.sense_mohm),
        "run_ma", "choose another current, or correct sense_mohm");
  }
  currents.run = ScaleOf(config.run_ma, range_v, config.sense_mohm);
  currents.hold = std::max(0, ScaleOf(config.hold_ma, range_v, config.sense_mohm));
  currents.run_ma = CurrentMa(currents.run, range_v, config.sense_mohm);
  return currents;
}

// pdn_disable: the pin is the serial line's. mstep_reg_select: microsteps from CHOPCONF, the pins
// being the address. multistep_filt: as after power-up.
std::uint32_t TmcGconf(const Tmc2209Config& config) {
  return (config.stealth_chop ? 0 : Bit(2)) | Bit(6) | Bit(7) | Bit(8);
}

std::uint32_t TmcChopconf(const Tmc2209Config& config, const TmcCurrents& currents) {
  constexpr std::uint32_t power_up = 0x10000053;  // interpolation to 256 microsteps on
  const auto exponent = std::countr_zero(static_cast<unsigned>(config.microsteps));
  return power_up | (currents.low_range ? Bit(17) : 0) |
         static_cast<std::uint32_t>(8 - exponent) << 24;
}

std::uint32_t TmcIholdIrun(const TmcCurrents& currents) {
  constexpr std::uint32_t hold_delay = 8;  // from run to hold current in steps of 2^18 clocks
  return static_cast<std::uint32_t>(currents.hold) | static_cast<std::uint32_t>(currents.run) << 8 |
         hold_delay << 16;
}

TmcFlags TmcFlagsOf(std::uint32_t gstat, std::uint32_t drv_status) {
  TmcFlags flags;
  flags.reset = gstat & Bit(0);
  flags.driver_error = gstat & Bit(1);
  flags.undervoltage = gstat & Bit(2);
  flags.hot = drv_status & Bit(0);
  flags.overtemperature = drv_status & Bit(1);
  flags.short_circuit = drv_status & (Bit(2) | Bit(3) | Bit(4) | Bit(5));
  flags.open_load = drv_status & (Bit(6) | Bit(7));
  return flags;
}

std::string TmcFaultWords(const TmcFlags& flags) {
  std::string words;
  const auto add = [&](bool up, const char* name) {
    if (up) words += (words.empty() ? "" : ", ") + std::string(name);
  };
  add(flags.reset, "the driver has started anew");
  add(flags.short_circuit, "short circuit");
  add(flags.overtemperature, "overtemperature");
  add(flags.undervoltage, "undervoltage");
  add(flags.driver_error && !flags.short_circuit && !flags.overtemperature,
      "outputs were switched off");
  return words;
}

Status ValidateTmc2209(const Tmc2209Config& config) {
  if (config.microsteps < 1 || config.microsteps > 256 ||
      !std::has_single_bit(static_cast<unsigned>(config.microsteps))) {
    return BadInput(fmt::format("a driver makes no {} microsteps", config.microsteps), "microsteps",
                    "choose 1, 2, 4, 8, 16, 32, 64, 128 or 256");
  }
  if (config.stall_threshold > 0 && !config.stealth_chop) {
    return BadInput("stalls are seen with StealthChop only", "stall_threshold",
                    "set stealth_chop = true, or wire a switch");
  }
  if (config.hold_ma > config.run_ma) {
    return BadInput("the current at rest is above that of a move", "hold_ma", "lower it");
  }
  SCAN_CHECK(TmcCurrentsOf(config));
  return {};
}

}  // namespace scan
