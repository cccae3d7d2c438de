// The simulated twin of a PWM chip, with the kernel's rules.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>

#include "drivers/io/pwm/pwm_files.h"

namespace scan {

// Refuses what the kernel refuses: a duty cycle above the period, a period of nothing, anything
// else before there is a period, another polarity while enabled, a channel that it does not have
// or that is taken.
// Thread contract: any thread.
class SimPwm final : public PwmFiles {
 public:
  SimPwm(std::string device, int channels);

  std::vector<PwmChip> Chips() override;
  tl::expected<std::string, int> Read(const std::string& attribute) override;
  int Write(const std::string& attribute, const std::string& value) override;

  // As a lamp between the output and ground sees it: 0 without an enabled output.
  double Brightness(int channel) const;
  // Taken by another driver of the kernel: its export is refused.
  void Take(int channel);
  // A channel's files belong to root for so many tries after its export.
  void DelayRights(int tries);
  // The N-th read or write from now on fails with EIO, and all after it; 0: none.
  void FailAt(std::int64_t nth);
  std::int64_t operations() const;

 private:
  struct Channel {
    std::int64_t period_ns = 0, duty_ns = 0;
    bool enabled = false, inversed = false;
    int tries_left = 0;
  };
  int Set(Channel& channel, const std::string& attribute, const std::string& value);
  bool Fails();

  const std::string device_;
  const int count_;
  mutable std::mutex mutex_;
  std::map<int, Channel> exported_;
  int taken_ = -1, rights_tries_ = 0;
  std::int64_t operations_ = 0, fail_at_ = 0;
};

}  // namespace scan
