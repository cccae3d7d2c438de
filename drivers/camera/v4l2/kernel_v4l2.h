// The real kernel behind the seam.
#pragma once

#include <filesystem>

#include "drivers/camera/v4l2/v4l2_system.h"

namespace scan {

class KernelV4l2 final : public V4l2System {
 public:
  // Other roots than the system's own are for tests.
  explicit KernelV4l2(std::filesystem::path sys = "/sys", std::filesystem::path dev = "/dev")
      : sys_(std::move(sys)), dev_(std::move(dev)) {}

  std::vector<VideoNode> ListNodes() override;
  int Open(const std::string& path) override;
  int Ioctl(int fd, unsigned long request, void* argument) override;
  int Map(int fd, std::size_t length, std::int64_t offset, void*& address) override;
  void Unmap(void* address, std::size_t length) override;
  int Poll(int fd, short events, int timeout_ms) override;
  void Close(int fd) override;

 private:
  std::filesystem::path sys_, dev_;
};

}  // namespace scan
