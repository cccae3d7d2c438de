#include "firmware-host/protocol/channel.h"

#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace scan {
namespace {

constexpr std::size_t kMaxLine = 1 << 20;
constexpr char kMend[] = "check that the other program is running and of the same version";

}  // namespace

Status Channel::Send(const Json& message) {
  const std::string line =
      message.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  const std::lock_guard lock(send_mutex_);
  std::size_t done = 0;
  while (done < line.size()) {
    const ssize_t n = ::send(fd_.get(), line.data() + done, line.size() - done, MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0)
      return Failed("cannot send (" + std::string(std::strerror(errno)) + ")", "socket", kMend);
    done += static_cast<std::size_t>(n);
  }
  return {};
}

Result<std::optional<Json>> Channel::Receive(std::optional<std::chrono::milliseconds> timeout) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + timeout.value_or(std::chrono::milliseconds(0));
  std::size_t searched = 0;
  while (true) {
    if (const auto end = buffer_.find('\n', searched); end != std::string::npos) {
      Json message = Json::parse(buffer_.begin(), buffer_.begin() + static_cast<long>(end), nullptr,
                                 /*allow_exceptions=*/false);
      buffer_.erase(0, end + 1);
      if (message.is_discarded()) return Failed("a line that is no JSON arrived", "socket", kMend);
      return std::optional<Json>(std::move(message));
    }
    searched = buffer_.size();
    if (buffer_.size() > kMaxLine)
      return Failed("a line above 1 MiB arrived", "socket", "send smaller requests");
    int wait_ms = -1;
    if (timeout) {
      const auto left =
          std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
      wait_ms = static_cast<int>(std::max<long>(left, 0));
    }
    pollfd descriptor{fd_.get(), POLLIN, 0};
    const int ready = ::poll(&descriptor, 1, wait_ms);
    if (ready == 0) return std::optional<Json>();
    if (ready < 0 && errno != EINTR) return Failed("cannot wait", "socket", kMend);
    if (ready < 0) continue;
    std::array<char, 65536> chunk;
    const ssize_t n = ::recv(fd_.get(), chunk.data(), chunk.size(), 0);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return Failed("the connection was closed", "socket", kMend);
    buffer_.append(chunk.data(), static_cast<std::size_t>(n));
  }
}

void Channel::Close() { ::shutdown(fd_.get(), SHUT_RDWR); }

}  // namespace scan
