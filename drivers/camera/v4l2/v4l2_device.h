// One opened video node; closes itself.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/base/result.h"
#include "drivers/camera/v4l2/v4l2_system.h"

namespace scan {

// What a failed call means for a person: `call` is the ioctl's name, `where` names the camera.
// `code` is an errno (positive).
Error V4l2Error(int code, std::string_view call, const std::string& where);

class V4l2Device {
 public:
  // Errors: device when it cannot be opened, or is no single-planar capture device that streams.
  static Result<std::unique_ptr<V4l2Device>> Open(std::shared_ptr<V4l2System> system,
                                                  const VideoNode& node);
  ~V4l2Device() { system_->Close(fd_); }
  V4l2Device(const V4l2Device&) = delete;
  V4l2Device& operator=(const V4l2Device&) = delete;

  // Repeats an interrupted call; gives the result or -errno.
  int Try(unsigned long request, void* argument);
  // The same where any failure is a device fault.
  Status Call(unsigned long request, std::string_view name, void* argument);

  V4l2System& system() { return *system_; }
  int fd() const { return fd_; }
  const VideoNode& node() const { return node_; }
  const std::string& card() const { return card_; }      // the device's name for itself
  const std::string& driver() const { return driver_; }  // kernel module
  std::string Where() const { return node_.name + " at " + node_.port; }

 private:
  V4l2Device(std::shared_ptr<V4l2System> system, VideoNode node, int fd)
      : system_(std::move(system)), node_(std::move(node)), fd_(fd) {}
  Status ReadCapabilities();

  std::shared_ptr<V4l2System> system_;
  VideoNode node_;
  int fd_;
  std::string card_, driver_;
};

// Which camera: its port, its name, or both; an empty field fits all. Never a node's number.
struct CameraSelector {
  std::string port;
  std::string name;
  friend bool operator==(const CameraSelector&, const CameraSelector&) = default;
};

// Every node that captures, opened for a moment. Nodes that cannot be opened are left out.
std::vector<VideoNode> ListCaptureNodes(const std::shared_ptr<V4l2System>& system);

// Opens the one camera that fits. Errors: device when none fits; bad_input when several do.
Result<std::unique_ptr<V4l2Device>> OpenSelected(const std::shared_ptr<V4l2System>& system,
                                                 const CameraSelector& selector);

}  // namespace scan
