#include "firmware-host/protocol/socket.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <thread>

namespace scan {
namespace {

Result<sockaddr_un> AddressOf(const std::filesystem::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string text = path.string();
  if (text.empty() || text.size() >= sizeof(address.sun_path))
    return BadInput("the socket path is empty or longer than 107 bytes", text,
                    "name a shorter --socket path");
  std::memcpy(address.sun_path, text.data(), text.size());
  return address;
}

UniqueFd NewSocket() { return UniqueFd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)); }

bool TryConnect(const UniqueFd& fd, const sockaddr_un& address) {
  return ::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
}

}  // namespace

Result<UniqueFd> ListenUnix(const std::filesystem::path& path) {
  SCAN_TRY(const sockaddr_un address, AddressOf(path));
  if (UniqueFd probe = NewSocket(); TryConnect(probe, address))
    return BadInput("another program already listens here", path.string(),
                    "stop it or name another --socket");
  struct stat info {};
  if (::lstat(path.c_str(), &info) == 0) {
    if (!S_ISSOCK(info.st_mode))
      return BadInput("a file that is no socket stands here", path.string(),
                      "remove it or name another --socket");
    ::unlink(path.c_str());
  }
  UniqueFd fd = NewSocket();
  const mode_t old_mask = ::umask(0177);
  const bool bound =
      ::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  const int bind_errno = errno;
  ::umask(old_mask);
  if (!bound || ::listen(fd.get(), 8) != 0)
    return BadInput(std::string("cannot listen (") + std::strerror(bind_errno) + ")", path.string(),
                    "check that the folder exists and may be written");
  return fd;
}

Result<UniqueFd> ConnectUnix(const std::filesystem::path& path,
                             std::chrono::milliseconds patience) {
  SCAN_TRY(const sockaddr_un address, AddressOf(path));
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (true) {
    UniqueFd fd = NewSocket();
    if (TryConnect(fd, address)) return fd;
    const int error = errno;
    if (std::chrono::steady_clock::now() >= deadline)
      return Failed(std::string("nobody answers (") + std::strerror(error) + ")", path.string(),
                    "start scanstationd, or name its socket with --socket");
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

std::filesystem::path DefaultSocket() {
  if (const char* runtime = std::getenv("XDG_RUNTIME_DIR"); runtime && *runtime)
    return std::filesystem::path(runtime) / "scanstation.sock";
  return "/run/scanstation/scanstation.sock";
}

Result<std::pair<UniqueFd, UniqueFd>> SocketPair() {
  int fds[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, fds) != 0)
    return Failed(std::string("cannot make a socket pair (") + std::strerror(errno) + ")",
                  "socketpair", "close other programs");
  return std::pair(UniqueFd(fds[0]), UniqueFd(fds[1]));
}

}  // namespace scan
