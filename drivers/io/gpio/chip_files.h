// Device files of GPIO chips, and waiting on several of their descriptors.
#pragma once

#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace scan {

// Sorted by name. A link is another name of a chip that is listed by its own: the Raspberry Pi 5
// has gpiochip4 -> gpiochip0.
inline std::vector<std::string> GpioChipPaths(const std::filesystem::path& folder = "/dev") {
  std::vector<std::string> paths;
  std::error_code error;
  std::filesystem::directory_iterator entry(folder, error);
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    std::error_code gone;
    if (entry->path().filename().string().starts_with("gpiochip") && !entry->is_symlink(gone)) {
      paths.push_back(entry->path().string());
    }
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

// poll() until one is readable or `timeout_ns` (negative: never) is over. False: an error.
inline bool PollUntil(std::vector<pollfd>& fds, std::int64_t timeout_ns) {
  const timespec timeout{timeout_ns / 1'000'000'000, timeout_ns % 1'000'000'000};
  for (;;) {
    if (ppoll(fds.data(), fds.size(), timeout_ns < 0 ? nullptr : &timeout, nullptr) >= 0) {
      return true;
    }
    if (errno != EINTR) return false;
  }
}

}  // namespace scan
