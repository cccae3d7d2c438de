#include "firmware-host/camera_worker/worker_link.h"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

namespace scan {
namespace {

constexpr std::size_t kMaxPacket = 64 << 10;
constexpr char kLinkWhere[] = "camera worker";
constexpr char kLinkMend[] = "check that both programs are of the same version";

using SteadyClock = std::chrono::steady_clock;

// Without a value: the time is over.
Result<bool> Wait(int fd, short events, SteadyClock::time_point deadline) {
  while (true) {
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(deadline - SteadyClock::now()).count();
    pollfd descriptor{fd, events, 0};
    const int ready = ::poll(&descriptor, 1, static_cast<int>(std::clamp<long>(left, 0, 1 << 30)));
    if (ready > 0) return true;
    if (ready == 0) return false;
    if (errno != EINTR)
      return Failed("cannot wait (" + std::string(std::strerror(errno)) + ")", kLinkWhere,
                    kLinkMend);
  }
}

// Takes every descriptor out of the packet, so that none is leaked whatever else is wrong with it.
std::vector<UniqueFd> TakeFiles(msghdr& header) {
  std::vector<UniqueFd> files;
  for (cmsghdr* part = CMSG_FIRSTHDR(&header); part; part = CMSG_NXTHDR(&header, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_RIGHTS) continue;
    const std::size_t count = (part->cmsg_len - CMSG_LEN(0)) / sizeof(int);
    for (std::size_t i = 0; i < count; ++i) {
      int fd = -1;
      std::memcpy(&fd, CMSG_DATA(part) + i * sizeof(int), sizeof fd);
      files.emplace_back(fd);
    }
  }
  return files;
}

}  // namespace

Status WorkerLink::Send(const WorkerMessage& message, std::chrono::milliseconds patience) {
  using nlohmann::json;
  std::string text = message.body.dump(-1, ' ', false, json::error_handler_t::replace);
  if (text.size() > kMaxPacket || message.files.size() > kMaxWorkerFiles)
    return BadInput("a message is too long", kLinkWhere, kLinkMend);
  iovec data{text.data(), text.size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(kMaxWorkerFiles * sizeof(int))> control{};
  msghdr header{};
  header.msg_iov = &data;
  header.msg_iovlen = 1;
  if (!message.files.empty()) {
    const std::size_t bytes = message.files.size() * sizeof(int);
    header.msg_control = control.data();
    header.msg_controllen = CMSG_SPACE(bytes);
    cmsghdr* part = CMSG_FIRSTHDR(&header);
    part->cmsg_level = SOL_SOCKET;
    part->cmsg_type = SCM_RIGHTS;
    part->cmsg_len = CMSG_LEN(bytes);
    for (std::size_t i = 0; i < message.files.size(); ++i) {
      const int fd = message.files[i].get();
      std::memcpy(CMSG_DATA(part) + i * sizeof(int), &fd, sizeof fd);
    }
  }
  const auto deadline = SteadyClock::now() + patience;
  while (true) {
    if (::sendmsg(socket_.get(), &header, MSG_NOSIGNAL | MSG_DONTWAIT) >= 0) return {};
    if (errno == EINTR) continue;
    if (errno != EAGAIN)
      return Failed("cannot send (" + std::string(std::strerror(errno)) + ")", kLinkWhere,
                    kLinkMend);
    SCAN_TRY(const bool writable, Wait(socket_.get(), POLLOUT, deadline));
    if (!writable) return Failed("the peer does not read", kLinkWhere, kLinkMend);
  }
}

Result<std::optional<WorkerMessage>> WorkerLink::Receive(std::chrono::milliseconds timeout) {
  SCAN_TRY(const bool readable, Wait(socket_.get(), POLLIN, SteadyClock::now() + timeout));
  if (!readable) return std::optional<WorkerMessage>();
  std::vector<char> buffer(kMaxPacket);
  iovec data{buffer.data(), buffer.size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(kMaxWorkerFiles * sizeof(int))> control{};
  msghdr header{};
  header.msg_iov = &data;
  header.msg_iovlen = 1;
  header.msg_control = control.data();
  header.msg_controllen = control.size();
  ssize_t bytes = -1;
  do {
    bytes = ::recvmsg(socket_.get(), &header, MSG_CMSG_CLOEXEC);
  } while (bytes < 0 && errno == EINTR);
  if (bytes <= 0) return Failed("the connection was closed", kLinkWhere, kLinkMend);
  std::optional<WorkerMessage> message(std::in_place);
  message->files = TakeFiles(header);
  if (header.msg_flags & (MSG_TRUNC | MSG_CTRUNC) || message->files.size() > kMaxWorkerFiles)
    return BadInput("a packet is too long or carries too many descriptors", kLinkWhere, kLinkMend);
  message->body = nlohmann::json::parse(buffer.data(), buffer.data() + bytes, nullptr,
                                        /*allow_exceptions=*/false);
  if (!message->body.is_object())
    return BadInput("a packet is no JSON object", kLinkWhere, kLinkMend);
  return message;
}

void WorkerLink::Close() { ::shutdown(socket_.get(), SHUT_RDWR); }

Result<std::pair<UniqueFd, UniqueFd>> WorkerSocketPair() {
  int fds[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, fds) != 0)
    return Failed("cannot make a socket pair (" + std::string(std::strerror(errno)) + ")",
                  kLinkWhere, "close other programs");
  return std::pair(UniqueFd(fds[0]), UniqueFd(fds[1]));
}

}  // namespace scan
