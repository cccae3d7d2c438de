// The seam to the kernel: every system call that the V4L2 camera makes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace scan {

// One video node as the system lists it, before it is opened.
struct VideoNode {
  std::string path;  // /dev/videoN: N is given anew at every plugging
  std::string name;  // as the driver calls the device
  // Where it is plugged in, the same after every boot: "CONTROLLER/PORT.PORT..." for USB (e.g.
  // 0000:00:14.0/1.4), else the name of the device that carries it (e.g. vivid.0).
  std::string port;
  std::string usb_id;  // vendor:product, empty where not USB
  std::string serial;  // as the device states it, may be empty
  friend bool operator==(const VideoNode&, const VideoNode&) = default;
};

// Calls behave as the system calls of their name; where those give -1 and errno, these give -errno.
// Thread contract: one thread at a time for one descriptor.
class V4l2System {
 public:
  virtual ~V4l2System() = default;
  virtual std::vector<VideoNode> ListNodes() = 0;  // by path
  virtual int Open(const std::string& path) = 0;   // read, write, non-blocking
  virtual int Ioctl(int fd, unsigned long request, void* argument) = 0;
  virtual int Map(int fd, std::size_t length, std::int64_t offset, void*& address) = 0;
  virtual void Unmap(void* address, std::size_t length) = 0;
  // The returned events; 0 when the time is over.
  virtual int Poll(int fd, short events, int timeout_ms) = 0;
  virtual void Close(int fd) = 0;
};

}  // namespace scan
