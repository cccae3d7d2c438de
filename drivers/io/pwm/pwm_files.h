// The kernel's PWM outputs as it shows them: the files below /sys/class/pwm.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace scan {

struct PwmChip {
  std::string folder;  // "pwmchip0": the number changes from boot to boot
  std::string device;  // "1f00098000.pwm": where it sits, always the same
  int channels = 0;
};

// Attributes are named below the folder of all chips: "pwmchip0/pwm1/period". Failures are errno.
// Thread contract: any thread.
class PwmFiles {
 public:
  virtual ~PwmFiles() = default;
  virtual std::vector<PwmChip> Chips() = 0;  // sorted by folder
  virtual tl::expected<std::string, int> Read(const std::string& attribute) = 0;  // no line end
  virtual int Write(const std::string& attribute, const std::string& value) = 0;  // 0: done
};

// Source: Documentation/ABI/testing/sysfs-class-pwm of the kernel.
std::shared_ptr<PwmFiles> KernelPwmFiles(const std::filesystem::path& root = "/sys/class/pwm");

}  // namespace scan
