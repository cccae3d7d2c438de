#include "drivers/motion/tmc2209/sim_tmc2209.h"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>

namespace scan {
namespace {

class MemoryPort final : public SerialPort {
 public:
  explicit MemoryPort(std::shared_ptr<SimTmc2209Line> line) : line_(std::move(line)) {}
  Status Write(std::span<const std::uint8_t> bytes) override {
    const auto back = line_->Exchange(bytes);
    arrived_.insert(arrived_.end(), back.begin(), back.end());
    return {};
  }
  Result<std::vector<std::uint8_t>> Read(std::size_t count, int) override {
    count = std::min(count, arrived_.size());
    const auto end = arrived_.begin() + static_cast<std::ptrdiff_t>(count);
    std::vector<std::uint8_t> bytes(arrived_.begin(), end);
    arrived_.erase(arrived_.begin(), end);
    return bytes;
  }
  Status Discard() override {
    arrived_.clear();
    return {};
  }

 private:
  std::shared_ptr<SimTmc2209Line> line_;
  std::deque<std::uint8_t> arrived_;
};

}  // namespace

SimTmc2209Line::SimTmc2209Line(int drivers) {
  for (int k = 0; k < drivers; ++k) drivers_[static_cast<std::size_t>(k)].there = true;
}

void SimTmc2209Line::Step(int address, bool positive) {
  std::lock_guard lock(mutex_);
  Driver& driver = drivers_.at(static_cast<std::size_t>(address));
  const bool by_register = driver.gconf >> 7 & 1;
  const auto mres = by_register ? driver.chopconf >> 24 & 15 : 5;  // 256 >> 5 microsteps
  const std::int64_t counts = std::int64_t{1} << mres;
  driver.mscnt = (driver.mscnt + (positive ? counts : kTmcCounts - counts)) % kTmcCounts;
}

void SimTmc2209Line::Reset(int address) {
  std::lock_guard lock(mutex_);
  Driver& driver = drivers_.at(static_cast<std::size_t>(address));
  driver = Driver();
  driver.there = true;
}

void SimTmc2209Line::SetStatus(int address, std::uint32_t drv_status) {
  std::lock_guard lock(mutex_);
  Driver& driver = drivers_.at(static_cast<std::size_t>(address));
  driver.drv_status = drv_status;
  constexpr std::uint32_t outputs_off = 0x3e;  // overtemperature and short circuits
  if (drv_status & outputs_off) driver.gstat |= 2;
}

std::uint32_t SimTmc2209Line::Register(int address, TmcRegister reg) const {
  std::lock_guard lock(mutex_);
  const Driver& driver = drivers_.at(static_cast<std::size_t>(address));
  switch (reg) {
    case TmcRegister::ihold_irun:
      return driver.ihold_irun;
    case TmcRegister::tcoolthrs:
      return driver.tcoolthrs;
    case TmcRegister::sgthrs:
      return driver.sgthrs;
    case TmcRegister::nodeconf:
      return driver.nodeconf;
    default:
      return Value(driver, static_cast<std::uint8_t>(reg)).value_or(0);
  }
}

void SimTmc2209Line::LoseReply(std::int64_t nth, bool all_after) {
  std::lock_guard lock(mutex_);
  requests_ = 0;
  lost_ = {nth, all_after};
}

void SimTmc2209Line::DamageReply(std::int64_t nth, bool all_after) {
  std::lock_guard lock(mutex_);
  requests_ = 0;
  damaged_ = {nth, all_after};
}

std::int64_t SimTmc2209Line::requests() const {
  std::lock_guard lock(mutex_);
  return requests_;
}

std::vector<std::uint8_t> SimTmc2209Line::Exchange(std::span<const std::uint8_t> sent) {
  std::lock_guard lock(mutex_);
  std::vector<std::uint8_t> back(sent.begin(), sent.end());
  received_.insert(received_.end(), sent.begin(), sent.end());
  for (;;) {
    while (!received_.empty() && received_[0] != kTmcSync) received_.erase(received_.begin());
    if (received_.size() < 4) return back;
    const std::size_t length = received_[2] & kTmcWriteBit ? 8 : 4;
    if (received_.size() < length) return back;
    const auto reply = Answer(std::span(received_).first(length));
    back.insert(back.end(), reply.begin(), reply.end());
    received_.erase(received_.begin(), received_.begin() + static_cast<std::ptrdiff_t>(length));
  }
}

std::vector<std::uint8_t> SimTmc2209Line::Answer(std::span<const std::uint8_t> request) {
  ++requests_;
  const std::size_t last = request.size() - 1;
  if (request[1] >= drivers_.size() || TmcCrc(request.first(last)) != request[last]) return {};
  Driver& driver = drivers_[request[1]];
  if (!driver.there || lost_.Hits(requests_)) return {};
  const auto reg = static_cast<std::uint8_t>(request[2] & ~kTmcWriteBit);
  if (request.size() == 8) {
    std::uint32_t value = 0;
    for (const std::uint8_t byte : request.subspan(3, 4)) value = value << 8 | byte;
    Accept(driver, reg, value);
    return {};
  }
  const auto value = Value(driver, reg);
  const auto reply = TmcReply(TmcRegister{reg}, value.value_or(0));
  std::vector<std::uint8_t> bytes(reply.begin(), reply.end());
  if (damaged_.Hits(requests_)) bytes[5] ^= 0x10;
  return bytes;
}

void SimTmc2209Line::Accept(Driver& driver, std::uint8_t reg, std::uint32_t value) {
  driver.ifcnt = (driver.ifcnt + 1) & 0xff;
  switch (TmcRegister{reg}) {
    case TmcRegister::gconf:
      driver.gconf = value;
      break;
    case TmcRegister::gstat:
      driver.gstat &= ~value;
      break;
    case TmcRegister::nodeconf:
      driver.nodeconf = value;
      break;
    case TmcRegister::ihold_irun:
      driver.ihold_irun = value;
      break;
    case TmcRegister::chopconf:
      driver.chopconf = value;
      break;
    case TmcRegister::tcoolthrs:
      driver.tcoolthrs = value;
      break;
    case TmcRegister::sgthrs:
      driver.sgthrs = value;
      break;
    default:
      break;  // counted, as the chip does, and without effect
  }
}

// Write-only registers read as zero.
std::optional<std::uint32_t> SimTmc2209Line::Value(const Driver& driver, std::uint8_t reg) {
  switch (TmcRegister{reg}) {
    case TmcRegister::gconf:
      return driver.gconf;
    case TmcRegister::gstat:
      return driver.gstat;
    case TmcRegister::ifcnt:
      return driver.ifcnt;
    case TmcRegister::ioin:
      return 0x21000000;
    case TmcRegister::mscnt:
      return static_cast<std::uint32_t>(driver.mscnt);
    case TmcRegister::chopconf:
      return driver.chopconf;
    case TmcRegister::drv_status:
      return driver.drv_status;
    default:
      return std::nullopt;
  }
}

SerialOpener OpenerOf(std::shared_ptr<SimTmc2209Line> line) {
  return [line](const std::string&) -> Result<std::unique_ptr<SerialPort>> {
    return std::make_unique<MemoryPort>(line);
  };
}

PtyTmc2209::PtyTmc2209(std::shared_ptr<SimTmc2209Line> line) : line_(std::move(line)) {
  master_.Reset(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC));
  if (!master_ || ::grantpt(master_.get()) != 0 || ::unlockpt(master_.get()) != 0) return;
  char name[128];
  if (::ptsname_r(master_.get(), name, sizeof(name)) != 0) return;
  held_.Reset(::open(name, O_RDWR | O_NOCTTY | O_CLOEXEC));  // else it hangs up between programs
  termios raw{};
  if (!held_ || ::tcgetattr(held_.get(), &raw) != 0) return;
  ::cfmakeraw(&raw);
  ::tcsetattr(held_.get(), TCSANOW, &raw);
  path_ = name;
  thread_ = std::jthread([this](std::stop_token stop) { Run(stop); });
}

void PtyTmc2209::Run(std::stop_token stop) {
  while (!stop.stop_requested()) {
    pollfd descriptor{master_.get(), POLLIN, 0};
    if (::poll(&descriptor, 1, 20) <= 0) continue;
    std::array<std::uint8_t, 64> bytes;
    const ssize_t n = ::read(master_.get(), bytes.data(), bytes.size());
    if (n <= 0) continue;
    const auto back = line_->Exchange(std::span(bytes).first(static_cast<std::size_t>(n)));
    if (::write(master_.get(), back.data(), back.size()) < 0) continue;
  }
}

}  // namespace scan
