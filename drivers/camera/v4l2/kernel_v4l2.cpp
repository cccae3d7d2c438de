#include "drivers/camera/v4l2/kernel_v4l2.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <regex>

namespace scan {
namespace {

namespace fs = std::filesystem;

std::string ReadLine(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

// .../CONTROLLER/usbB/B-1/B-1.4/B-1.4:1.0 -> CONTROLLER/1.4: the number B of the bus depends on
// the order in which controllers are found, the controller's own name does not.
void DescribePlace(const fs::path& device, VideoNode& node) {
  static const std::regex usb_device(R"(\d+-(\d+(?:\.\d+)*))"), usb_root(R"(usb\d+)");
  std::smatch match;
  for (fs::path at = device; at.has_relative_path(); at = at.parent_path()) {
    const std::string name = at.filename();
    if (!std::regex_match(name, match, usb_device)) continue;
    fs::path root = at;
    while (root.has_relative_path() && !std::regex_match(root.filename().string(), usb_root))
      root = root.parent_path();
    node.port = root.parent_path().filename().string() + "/" + match[1].str();
    node.usb_id = ReadLine(at / "idVendor") + ":" + ReadLine(at / "idProduct");
    node.serial = ReadLine(at / "serial");
    return;
  }
  node.port = device.filename();
}

int OrErrno(int result) { return result < 0 ? -errno : result; }

}  // namespace

std::vector<VideoNode> KernelV4l2::ListNodes() {
  std::vector<VideoNode> nodes;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(sys_ / "class/video4linux", ignored)) {
    const std::string number = entry.path().filename();
    if (!number.starts_with("video")) continue;  // not v4l-subdev, vbi, radio
    VideoNode node;
    node.path = (dev_ / number).string();
    node.name = ReadLine(entry.path() / "name");
    const fs::path device = fs::canonical(entry.path() / "device", ignored);
    if (device.empty()) continue;  // unplugged while we looked
    DescribePlace(device, node);
    nodes.push_back(std::move(node));
  }
  std::sort(nodes.begin(), nodes.end(), [](const VideoNode& a, const VideoNode& b) {
    return a.path.size() != b.path.size() ? a.path.size() < b.path.size() : a.path < b.path;
  });
  return nodes;
}

int KernelV4l2::Open(const std::string& path) {
  return OrErrno(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
}

int KernelV4l2::Ioctl(int fd, unsigned long request, void* argument) {
  return OrErrno(::ioctl(fd, request, argument));
}

int KernelV4l2::Map(int fd, std::size_t length, std::int64_t offset, void*& address) {
  address = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, fd, offset);
  if (address != MAP_FAILED) return 0;
  address = nullptr;
  return -errno;
}

void KernelV4l2::Unmap(void* address, std::size_t length) { ::munmap(address, length); }

int KernelV4l2::Poll(int fd, short events, int timeout_ms) {
  pollfd waiting{fd, events, 0};
  const int ready = ::poll(&waiting, 1, timeout_ms);
  if (ready < 0) return -errno;
  return ready == 0 ? 0 : waiting.revents;
}

void KernelV4l2::Close(int fd) { ::close(fd); }

}  // namespace scan
