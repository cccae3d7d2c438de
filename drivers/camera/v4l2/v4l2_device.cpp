#include "drivers/camera/v4l2/v4l2_device.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>

namespace scan {
namespace {

constexpr int kMaxInterruptions = 100;

std::string MendFor(int code) {
  switch (code) {
    case ENODEV:
    case ENXIO:
    case ENOENT:
      return "plug the camera in again at the same port";
    case EBUSY:
      return "end the other program that uses the camera (fuser -v /dev/video*)";
    case EACCES:
    case EPERM:
      return "add the user to the group 'video' and log in again";
    case ENOSPC:
      return "the USB bus has no room for this stream: choose MJPG or a smaller size, or another "
             "controller";
    case EIO:
    case EPIPE:
    case EPROTO:
    case ETIMEDOUT:
      return "check cable, hub and power supply of the camera";
    default:
      return "replug the camera; if it stays, look at the kernel's log (dmesg)";
  }
}

std::string TextOf(const __u8* field, std::size_t size) {
  const auto* text = reinterpret_cast<const char*>(field);
  return {text, strnlen(text, size)};
}

bool Fits(const VideoNode& node, const CameraSelector& selector) {
  return (selector.port.empty() || node.port == selector.port) &&
         (selector.name.empty() || node.name == selector.name);
}

std::string Describe(const std::vector<VideoNode>& nodes) {
  if (nodes.empty()) return "no camera is connected";
  std::string text = "connected:";
  for (const VideoNode& node : nodes)
    text += fmt::format(" '{}' at {};", node.name, node.port.empty() ? "no port" : node.port);
  text.pop_back();
  return text;
}

}  // namespace

Error V4l2Error(int code, std::string_view call, const std::string& where) {
  return {ErrorKind::device, fmt::format("{} failed: {}", call, std::strerror(code)), where,
          MendFor(code)};
}

Result<std::unique_ptr<V4l2Device>> V4l2Device::Open(std::shared_ptr<V4l2System> system,
                                                     const VideoNode& node) {
  const int fd = system->Open(node.path);
  if (fd < 0) return tl::unexpected(V4l2Error(-fd, "open " + node.path, node.name));
  std::unique_ptr<V4l2Device> device(new V4l2Device(std::move(system), node, fd));
  SCAN_CHECK(device->ReadCapabilities());
  return device;
}

Status V4l2Device::ReadCapabilities() {
  v4l2_capability capability{};
  SCAN_CHECK(Call(VIDIOC_QUERYCAP, "VIDIOC_QUERYCAP", &capability));
  const std::uint32_t bits = capability.capabilities & V4L2_CAP_DEVICE_CAPS
                                 ? capability.device_caps
                                 : capability.capabilities;
  if (!(bits & V4L2_CAP_VIDEO_CAPTURE) || !(bits & V4L2_CAP_STREAMING))
    return DeviceFault("the node captures no single-planar video", Where(),
                       "choose a camera that 'scanstation device camera list' shows");
  card_ = TextOf(capability.card, sizeof(capability.card));
  driver_ = TextOf(capability.driver, sizeof(capability.driver));
  return {};
}

int V4l2Device::Try(unsigned long request, void* argument) {
  int result = -EINTR;
  for (int i = 0; result == -EINTR && i < kMaxInterruptions; ++i)
    result = system_->Ioctl(fd_, request, argument);
  return result;
}

Status V4l2Device::Call(unsigned long request, std::string_view name, void* argument) {
  if (const int result = Try(request, argument); result < 0)
    return tl::unexpected(V4l2Error(-result, name, Where()));
  return {};
}

std::vector<VideoNode> ListCaptureNodes(const std::shared_ptr<V4l2System>& system) {
  std::vector<VideoNode> nodes = system->ListNodes();
  std::erase_if(nodes, [&](const VideoNode& node) { return !V4l2Device::Open(system, node); });
  return nodes;
}

Result<std::unique_ptr<V4l2Device>> OpenSelected(const std::shared_ptr<V4l2System>& system,
                                                 const CameraSelector& selector) {
  const std::vector<VideoNode> all = system->ListNodes();
  std::unique_ptr<V4l2Device> found;
  std::optional<Error> fault;
  int count = 0;
  for (const VideoNode& node : all) {
    if (!Fits(node, selector)) continue;
    auto device = V4l2Device::Open(system, node);
    if (!device) {  // a UVC camera's second node only carries metadata
      if (!fault) fault = device.error();
      continue;
    }
    ++count;
    if (!found) found = std::move(*device);
  }
  const std::string where =
      fmt::format("camera port '{}', name '{}'", selector.port, selector.name);
  if (count > 1)
    return BadInput("several cameras fit; " + Describe(all), where,
                    "give the port of the one that is meant, and its name if that is not enough");
  if (found) return found;
  if (fault) return tl::unexpected(*fault);
  return DeviceFault("the camera is not there; " + Describe(all), where,
                     "plug it in at that port, or correct port and name");
}

}  // namespace scan
