#include "drivers/io/pwm/sim_pwm.h"

#include <cerrno>
#include <charconv>
#include <optional>

namespace scan {
namespace {

constexpr const char* kFolder = "pwmchip0";

std::optional<std::int64_t> NumberIn(const std::string& text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// "pwmchip0/pwm1/period" is channel 1's "period".
struct Attribute {
  int channel = -1;
  std::string name;
};
Attribute AttributeOf(const std::string& path) {
  const std::string prefix = std::string(kFolder) + "/pwm";
  const std::size_t slash = path.rfind('/');
  if (!path.starts_with(prefix) || slash <= prefix.size()) return {};
  const auto channel = NumberIn(path.substr(prefix.size(), slash - prefix.size()));
  return {channel ? static_cast<int>(*channel) : -1, path.substr(slash + 1)};
}

}  // namespace

SimPwm::SimPwm(std::string device, int channels) : device_(std::move(device)), count_(channels) {}

std::vector<PwmChip> SimPwm::Chips() { return {{kFolder, device_, count_}}; }

tl::expected<std::string, int> SimPwm::Read(const std::string& attribute) {
  std::lock_guard lock(mutex_);
  if (Fails()) return tl::unexpected(EIO);
  const Attribute asked = AttributeOf(attribute);
  const auto found = exported_.find(asked.channel);
  if (found == exported_.end()) return tl::unexpected(ENOENT);
  const Channel& channel = found->second;
  if (asked.name == "period") return std::to_string(channel.period_ns);
  if (asked.name == "duty_cycle") return std::to_string(channel.duty_ns);
  if (asked.name == "enable") return std::string(channel.enabled ? "1" : "0");
  if (asked.name == "polarity") return std::string(channel.inversed ? "inversed" : "normal");
  return tl::unexpected(ENOENT);
}

int SimPwm::Write(const std::string& attribute, const std::string& value) {
  std::lock_guard lock(mutex_);
  if (Fails()) return EIO;
  if (attribute == std::string(kFolder) + "/export") {
    const auto channel = NumberIn(value);
    if (!channel || *channel < 0 || *channel >= count_) return ENODEV;
    const int number = static_cast<int>(*channel);
    if (number == taken_ || exported_.contains(number)) return EBUSY;
    exported_[number].tries_left = rights_tries_;
    return 0;
  }
  const Attribute asked = AttributeOf(attribute);
  const auto found = exported_.find(asked.channel);
  if (found == exported_.end()) return ENOENT;
  if (found->second.tries_left > 0) {
    --found->second.tries_left;
    return EACCES;
  }
  return Set(found->second, asked.name, value);
}

int SimPwm::Set(Channel& channel, const std::string& attribute, const std::string& value) {
  Channel next = channel;
  if (attribute == "polarity") {
    if (value != "normal" && value != "inversed") return EINVAL;
    if (channel.enabled) return EBUSY;
    if (channel.period_ns == 0) return EINVAL;
    next.inversed = value == "inversed";
    channel = next;
    return 0;
  }
  const auto number = NumberIn(value);
  if (!number || *number < 0) return EINVAL;
  if (attribute == "period") {
    next.period_ns = *number;
  } else if (attribute == "duty_cycle") {
    next.duty_ns = *number;
  } else if (attribute == "enable" && *number <= 1) {
    next.enabled = *number == 1;
  } else {
    return attribute == "enable" ? EINVAL : ENOENT;
  }
  if (next.period_ns == 0 || next.duty_ns > next.period_ns) return EINVAL;
  channel = next;
  return 0;
}

double SimPwm::Brightness(int channel) const {
  std::lock_guard lock(mutex_);
  const auto found = exported_.find(channel);
  if (found == exported_.end() || !found->second.enabled) return 0;
  const double high =
      static_cast<double>(found->second.duty_ns) / static_cast<double>(found->second.period_ns);
  return found->second.inversed ? 1 - high : high;
}

void SimPwm::Take(int channel) {
  std::lock_guard lock(mutex_);
  taken_ = channel;
}

void SimPwm::DelayRights(int tries) {
  std::lock_guard lock(mutex_);
  rights_tries_ = tries;
}

void SimPwm::FailAt(std::int64_t nth) {
  std::lock_guard lock(mutex_);
  operations_ = 0;
  fail_at_ = nth;
}

std::int64_t SimPwm::operations() const {
  std::lock_guard lock(mutex_);
  return operations_;
}

bool SimPwm::Fails() { return ++operations_ >= fail_at_ && fail_at_ > 0; }

}  // namespace scan
