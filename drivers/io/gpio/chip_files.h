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

inline std::vector<std::string> GpioChipPaths() {
  std::vector<std::string> paths;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", error)) {
    if (entry.path().filename().string().rfind("gpiochip", 0) == 0) {
      paths.push_back(entry.path().string());
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
