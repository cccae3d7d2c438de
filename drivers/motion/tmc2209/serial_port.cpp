#include "drivers/motion/tmc2209/serial_port.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "drivers/base/unique_fd.h"

namespace scan {
namespace {

class KernelSerialPort final : public SerialPort {
 public:
  KernelSerialPort(UniqueFd fd, std::string path) : fd_(std::move(fd)), path_(std::move(path)) {}

  Status Write(std::span<const std::uint8_t> bytes) override {
    while (!bytes.empty()) {
      const ssize_t n = ::write(fd_.get(), bytes.data(), bytes.size());
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) return Fault("cannot write", std::strerror(errno));
      bytes = bytes.subspan(static_cast<std::size_t>(n));
    }
    return {};
  }

  Result<std::vector<std::uint8_t>> Read(std::size_t count, int timeout_ms) override {
    std::vector<std::uint8_t> bytes(count);
    std::size_t done = 0;
    while (done < count) {
      pollfd descriptor{fd_.get(), POLLIN, 0};
      const int ready = ::poll(&descriptor, 1, timeout_ms);
      if (ready < 0 && errno == EINTR) continue;
      if (ready < 0) return Fault("cannot wait", std::strerror(errno));
      if (ready == 0) break;
      const ssize_t n = ::read(fd_.get(), bytes.data() + done, count - done);
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) return Fault("cannot read", std::strerror(errno));
      if (n == 0) return Fault("cannot read", "the line has gone");
      done += static_cast<std::size_t>(n);
    }
    bytes.resize(done);
    return bytes;
  }

  Status Discard() override {
    if (::tcflush(fd_.get(), TCIFLUSH) != 0) return Fault("cannot flush", std::strerror(errno));
    return {};
  }

 private:
  tl::unexpected<Error> Fault(const char* what, const char* why) const {
    return DeviceFault(fmt::format("{}: {}", what, why), "serial " + path_,
                       "check that the adapter is still there, then start again");
  }

  UniqueFd fd_;
  const std::string path_;
};

}  // namespace

Result<std::unique_ptr<SerialPort>> OpenSerialPort(const std::string& path) {
  const auto fault = [&](const char* what, const char* mend) {
    return DeviceFault(fmt::format("{}: {}", what, std::strerror(errno)), "serial " + path, mend);
  };
  // Non-blocking for the open alone: it would else wait for a carrier that nobody gives.
  UniqueFd fd(::open(path.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK));
  if (!fd) {
    const char* mend = "name one that is there ('ls /dev/serial/by-path /dev/ttyAMA*')";
    if (errno == EACCES) mend = "add this user to the group of that file (dialout)";
    if (errno == EBUSY) mend = "end the program that has it (scanstation-motiond, or a console)";
    return fault("cannot open the serial line", mend);
  }
  termios line{};
  if (::tcgetattr(fd.get(), &line) != 0) return fault("is no serial line", "name another");
  if (::ioctl(fd.get(), TIOCEXCL) != 0) return fault("cannot have the line alone", "name another");
  ::cfmakeraw(&line);
  line.c_cflag |= CLOCAL | CREAD;
  line.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
  ::cfsetispeed(&line, B115200);
  ::cfsetospeed(&line, B115200);
  line.c_cc[VMIN] = 0;
  line.c_cc[VTIME] = 0;
  if (::tcsetattr(fd.get(), TCSANOW, &line) != 0) {
    return fault("cannot set 115200 baud", "name a line that can");
  }
  if (::fcntl(fd.get(), F_SETFL, 0) != 0) return fault("cannot wait for the line", "name another");
  return std::make_unique<KernelSerialPort>(std::move(fd), path);
}

}  // namespace scan
