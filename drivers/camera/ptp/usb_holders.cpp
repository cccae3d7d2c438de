#include "drivers/camera/ptp/usb_holders.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <string_view>

namespace scan {
namespace {

namespace fs = std::filesystem;

// As the kernel shortens names: to 15 letters.
constexpr std::array<std::string_view, 2> kServices{"gvfs-gphoto2-vo", "gvfsd-gphoto2"};

bool HoldsOpen(const fs::path& process, const fs::path& node) {
  std::error_code error;  // gone meanwhile, or another user's
  for (fs::directory_iterator it(process / "fd", error), end; !error && it != end;
       it.increment(error)) {
    std::error_code unreadable;
    if (fs::read_symlink(it->path(), unreadable) == node && !unreadable) return true;
  }
  return false;
}

}  // namespace

bool IsDesktopService(const std::string& program) {
  return std::any_of(kServices.begin(), kServices.end(),
                     [&](std::string_view service) { return program.starts_with(service); });
}

std::vector<std::string> ProgramsTakingCamera(const fs::path& node, const fs::path& proc) {
  std::vector<std::pair<int, std::string>> found;
  std::error_code error;
  for (fs::directory_iterator it(proc, error), end; !error && it != end; it.increment(error)) {
    const std::string word = it->path().filename().string();
    int pid = 0;
    const auto [at, code] = std::from_chars(word.data(), word.data() + word.size(), pid);
    if (code != std::errc() || at != word.data() + word.size() || pid == getpid()) continue;
    std::string name;
    std::ifstream comm(it->path() / "comm");
    if (!std::getline(comm, name)) continue;
    if (IsDesktopService(name) || HoldsOpen(it->path(), node)) found.emplace_back(pid, name);
  }
  std::sort(found.begin(), found.end());
  std::vector<std::string> programs;
  for (const auto& [pid, name] : found) programs.push_back(fmt::format("{} ({})", name, pid));
  return programs;
}

}  // namespace scan
