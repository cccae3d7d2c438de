#include "drivers/io/pwm/pwm_lamp.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <mutex>

namespace scan {
namespace {

constexpr int kRightsTries = 100;  // 1 s in all
constexpr std::int64_t kRightsPauseNs = 10'000'000;

class PwmLamp final : public Lamp {
 public:
  PwmLamp(const LightConfig& config, const PwmChip& chip, std::shared_ptr<PwmFiles> files)
      : config_(config),
        chip_(chip),
        output_(fmt::format("{}/pwm{}", chip.folder, config.channel)),
        period_ns_(std::llround(config.period_us * 1e3)),
        files_(std::move(files)) {}
  ~PwmLamp() override { (void)SetLevel(0); }

  Status Start(Clock& clock) {
    if (!files_->Read(output_ + "/period")) {
      SCAN_CHECK(Done(files_->Write(chip_.folder + "/export", std::to_string(config_.channel)),
                      "export the channel"));
    }
    SCAN_CHECK(WaitForRights(clock));
    // The kernel refuses a duty cycle above the period, also in passing, and anything but a period
    // where there is none yet (a fresh channel). So darkness comes before a period that it fits.
    const std::int64_t dark_ns = config_.active_low ? period_ns_ : 0;
    const std::int64_t old_ns = PeriodNs();
    if (old_ns > 0 && old_ns >= dark_ns) SCAN_CHECK(Set("duty_cycle", std::to_string(dark_ns)));
    SCAN_CHECK(Set("period", std::to_string(period_ns_)));
    SCAN_CHECK(SetLevel(0));
    const auto polarity = files_->Read(output_ + "/polarity");
    if (polarity && *polarity == "inversed") {  // changes while disabled only
      SCAN_CHECK(Set("enable", "0"));
      SCAN_CHECK(Set("polarity", "normal"));
    }
    return Set("enable", "1");
  }

  Status SetLevel(double level) override {
    if (!(level >= 0 && level <= 1)) {
      return BadInput(fmt::format("{} is no level", level), Where(), "give 0 to 1");
    }
    const std::int64_t lit_ns = std::llround(level * static_cast<double>(period_ns_));
    std::lock_guard lock(mutex_);
    return Set("duty_cycle", std::to_string(config_.active_low ? period_ns_ - lit_ns : lit_ns));
  }

 private:
  std::string Where() const {
    return fmt::format("light {} channel {}", chip_.device, config_.channel);
  }
  Status Done(int error, const std::string& what) const {
    if (error == 0) return {};
    std::string mend = "check the overlay that makes this output, and light.period_us";
    if (error == EBUSY) mend = "another driver of the kernel uses it: choose another channel";
    if (error == EACCES || error == EPERM) {
      mend = "copy udev/60-scanstation.rules to /etc/udev/rules.d, add this user to the group gpio";
    }
    return DeviceFault(fmt::format("cannot {}: {}", what, std::strerror(error)), Where(), mend);
  }
  std::int64_t PeriodNs() {  // of the channel as it was found; 0: none
    std::int64_t ns = 0;
    if (const auto text = files_->Read(output_ + "/period")) {
      std::from_chars(text->data(), text->data() + text->size(), ns);
    }
    return ns;
  }
  Status Set(const char* attribute, const std::string& value) {
    return Done(files_->Write(output_ + "/" + attribute, value),
                fmt::format("set {} to {}", attribute, value));
  }
  // What an export makes belongs to root until udev has seen it.
  Status WaitForRights(Clock& clock) {
    int error = 0;
    for (int k = 0; k < kRightsTries; ++k) {
      const auto now = files_->Read(output_ + "/enable");
      error = now ? files_->Write(output_ + "/enable", *now) : now.error();
      if (error != EACCES && error != EPERM && error != ENOENT) break;
      clock.SleepFor(kRightsPauseNs);
    }
    // A channel without a period cannot be enabled or disabled anew: that is no lack of rights.
    return Done(error == EINVAL ? 0 : error, "open the channel");
  }

  const LightConfig config_;
  const PwmChip chip_;
  const std::string output_;
  const std::int64_t period_ns_;
  std::shared_ptr<PwmFiles> files_;
  std::mutex mutex_;
};

}  // namespace

Result<PwmChip> FindPwmChip(PwmFiles& files, const std::string& device) {
  std::vector<std::string> devices;
  for (const PwmChip& chip : files.Chips()) {
    if (chip.device == device) return chip;
    devices.push_back(chip.device);
  }
  return DeviceFault(
      fmt::format("there is no PWM chip '{}' (chips here: {})", device,
                  devices.empty() ? "none" : fmt::format("{}", fmt::join(devices, ", "))),
      "light.chip",
      "name the device of one ('ls -l /sys/class/pwm/*/device'); on a Raspberry Pi add "
      "dtoverlay=pwm to config.txt");
}

Result<std::unique_ptr<Lamp>> OpenPwmLamp(const LightConfig& config,
                                          std::shared_ptr<PwmFiles> files,
                                          std::shared_ptr<Clock> clock) {
  SCAN_TRY(const PwmChip chip, FindPwmChip(*files, config.chip));
  if (config.channel >= chip.channels) {
    return BadInput(
        fmt::format("{} has {} channels and no {}", chip.device, chip.channels, config.channel),
        "light.channel", "choose one from 0");
  }
  auto lamp = std::make_unique<PwmLamp>(config, chip, std::move(files));
  SCAN_CHECK(lamp->Start(*clock));
  return lamp;
}

}  // namespace scan
