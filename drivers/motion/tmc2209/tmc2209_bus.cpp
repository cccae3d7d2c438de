#include "drivers/motion/tmc2209/tmc2209_bus.h"

#include <fmt/format.h>

#include <algorithm>

namespace scan {
namespace {

constexpr int kTries = 3;
constexpr int kTimeoutMs = 20;  // a reply begins after less than 1 ms; USB adapters need more
constexpr std::uint32_t kSendDelay = 2u << 8;  // NODECONF, section 5.1: for several on a line
constexpr std::uint32_t kAllFlags = 7;
constexpr int kVersion = 0x21;
constexpr const char* kMend =
    "check the motors' supply (without it the drivers are silent), the wire, the resistor of 1 "
    "kOhm "
    "between TX and RX, and the address";

}  // namespace

Result<std::shared_ptr<Tmc2209Bus>> Tmc2209Bus::Open(const SerialOpener& open,
                                                     const std::string& path) {
  SCAN_TRY(auto port, open(path));
  std::shared_ptr<Tmc2209Bus> bus(new Tmc2209Bus(std::move(port), path));
  // Before anything is read: else a driver could take another one's answer for a request.
  for (int address = 0; address < kTmcMaxAddresses; ++address) {
    SCAN_CHECK(bus->Send(TmcWriteRequest(address, TmcRegister::nodeconf, kSendDelay)));
  }
  return bus;
}

std::string Tmc2209Bus::Where(int address) const {
  return fmt::format("TMC2209 {} at {}", address, path_);
}

Status Tmc2209Bus::Send(std::span<const std::uint8_t> request) {
  SCAN_CHECK(port_->Discard());
  SCAN_CHECK(port_->Write(request));
  SCAN_CHECK(port_->Read(request.size(), kTimeoutMs));  // the echo
  return {};
}

Result<std::uint32_t> Tmc2209Bus::Read(int address, TmcRegister reg) {
  std::lock_guard lock(mutex_);
  return ReadLocked(address, reg);
}

Result<std::uint32_t> Tmc2209Bus::ReadLocked(int address, TmcRegister reg) {
  bool heard = false;
  for (int k = 0; k < kTries; ++k) {
    SCAN_CHECK(Send(TmcReadRequest(address, reg)));
    SCAN_TRY(const auto reply, port_->Read(8, kTimeoutMs));
    if (const auto value = TmcReplyValue(reply, reg)) return *value;
    heard = heard || !reply.empty();
  }
  return DeviceFault(heard ? "its replies are damaged" : "it does not answer", Where(address),
                     heard ? "shorten the wire, and keep it away from the motors' wires" : kMend);
}

Status Tmc2209Bus::Write(int address, TmcRegister reg, std::uint32_t value) {
  std::lock_guard lock(mutex_);
  for (int k = 0; k < kTries; ++k) {
    SCAN_TRY(const std::uint32_t before, ReadLocked(address, TmcRegister::ifcnt));
    SCAN_CHECK(Send(TmcWriteRequest(address, reg, value)));
    SCAN_TRY(const std::uint32_t after, ReadLocked(address, TmcRegister::ifcnt));
    if (((after - before) & 0xff) == 1) return {};
  }
  return DeviceFault(
      fmt::format("it did not take a value for register {:#04x}", static_cast<unsigned>(reg)),
      Where(address), kMend);
}

Result<Tmc2209State> ReadTmc2209(Tmc2209Bus& bus, int address) {
  Tmc2209State state;
  SCAN_TRY(const std::uint32_t ioin, bus.Read(address, TmcRegister::ioin));
  SCAN_TRY(const std::uint32_t gstat, bus.Read(address, TmcRegister::gstat));
  SCAN_TRY(const std::uint32_t status, bus.Read(address, TmcRegister::drv_status));
  SCAN_TRY(const std::uint32_t mscnt, bus.Read(address, TmcRegister::mscnt));
  state.version = static_cast<int>(ioin >> 24);
  state.flags = TmcFlagsOf(gstat, status);
  state.mscnt = mscnt % kTmcCounts;
  state.current_scale = static_cast<int>(status >> 16 & 31);
  state.standstill = status >> 31;
  return state;
}

Result<TmcCurrents> SetUpTmc2209(Tmc2209Bus& bus, const Tmc2209Config& config) {
  SCAN_CHECK(ValidateTmc2209(config));
  SCAN_TRY(const TmcCurrents currents, TmcCurrentsOf(config));
  const int address = config.address;
  const std::string where = fmt::format("TMC2209 {} at {}", address, config.port);
  SCAN_TRY(const std::uint32_t ioin, bus.Read(address, TmcRegister::ioin));
  if (ioin >> 24 != kVersion) {
    return DeviceFault(
        fmt::format("the chip there has version {:#04x}, not {:#04x}", ioin >> 24, kVersion), where,
        "name the address of a TMC2209");
  }
  const std::uint32_t gconf = TmcGconf(config), chopconf = TmcChopconf(config, currents);
  SCAN_CHECK(bus.Write(address, TmcRegister::gconf, gconf));
  SCAN_CHECK(bus.Write(address, TmcRegister::chopconf, chopconf));
  SCAN_CHECK(bus.Write(address, TmcRegister::ihold_irun, TmcIholdIrun(currents)));
  SCAN_CHECK(ShowStalls(bus, config, false));
  SCAN_CHECK(bus.Write(address, TmcRegister::gstat, kAllFlags));  // cleared by writing ones
  for (const auto& [reg, wanted] :
       {std::pair(TmcRegister::gconf, gconf), std::pair(TmcRegister::chopconf, chopconf),
        std::pair(TmcRegister::gstat, 0U)}) {
    SCAN_TRY(const std::uint32_t read, bus.Read(address, reg));
    if (read == wanted) continue;
    return DeviceFault(
        fmt::format("register {:#04x} reads {:#010x} instead of {:#010x}",
                    static_cast<unsigned>(reg), read, wanted),
        where, reg == TmcRegister::gstat ? "check the motor's wires and the supply" : kMend);
  }
  return currents;
}

Status ShowStalls(Tmc2209Bus& bus, const Tmc2209Config& config, bool on) {
  if (config.stall_threshold == 0) return {};
  // Section 11: DIAG shows SG_RESULT <= 2 SGTHRS at all speeds above the one of TCOOLTHRS.
  constexpr std::uint32_t every_speed = 0xfffff;
  SCAN_CHECK(bus.Write(config.address, TmcRegister::sgthrs,
                       on ? static_cast<std::uint32_t>(config.stall_threshold) : 0));
  return bus.Write(config.address, TmcRegister::tcoolthrs, on ? every_speed : 0);
}

}  // namespace scan
