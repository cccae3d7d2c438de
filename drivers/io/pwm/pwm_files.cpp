#include "drivers/io/pwm/pwm_files.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>

#include "drivers/base/unique_fd.h"

namespace scan {
namespace {

class KernelFiles final : public PwmFiles {
 public:
  explicit KernelFiles(std::filesystem::path root) : root_(std::move(root)) {}

  std::vector<PwmChip> Chips() override {
    std::vector<PwmChip> chips;
    std::error_code error;
    std::filesystem::directory_iterator entry(root_, error);
    for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
      PwmChip chip{entry->path().filename().string(), "", 0};
      if (!chip.folder.starts_with("pwmchip")) continue;
      std::error_code none;
      chip.device = std::filesystem::read_symlink(entry->path() / "device", none).filename();
      if (const auto count = Read(chip.folder + "/npwm")) {
        std::from_chars(count->data(), count->data() + count->size(), chip.channels);
      }
      chips.push_back(std::move(chip));
    }
    std::sort(chips.begin(), chips.end(),
              [](const PwmChip& a, const PwmChip& b) { return a.folder < b.folder; });
    return chips;
  }

  tl::expected<std::string, int> Read(const std::string& attribute) override {
    const UniqueFd fd(::open((root_ / attribute).c_str(), O_RDONLY | O_CLOEXEC));
    if (!fd) return tl::unexpected(errno);
    std::array<char, 64> text;
    const ssize_t n = ::read(fd.get(), text.data(), text.size());
    if (n < 0) return tl::unexpected(errno);
    std::string value(text.data(), static_cast<std::size_t>(n));
    while (value.ends_with('\n')) value.pop_back();
    return value;
  }

  int Write(const std::string& attribute, const std::string& value) override {
    const UniqueFd fd(::open((root_ / attribute).c_str(), O_WRONLY | O_CLOEXEC));
    if (!fd) return errno;
    const ssize_t n = ::write(fd.get(), value.data(), value.size());
    if (n < 0) return errno;
    return static_cast<std::size_t>(n) == value.size() ? 0 : EIO;
  }

 private:
  const std::filesystem::path root_;
};

}  // namespace

std::shared_ptr<PwmFiles> KernelPwmFiles(const std::filesystem::path& root) {
  return std::make_shared<KernelFiles>(root);
}

}  // namespace scan
