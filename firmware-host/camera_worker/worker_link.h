// The socket between a camera worker and its owner: one JSON document a packet, with descriptors.
#pragma once

#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "drivers/base/result.h"
#include "drivers/base/unique_fd.h"

namespace scan {

struct WorkerMessage {
  nlohmann::json body;
  std::vector<UniqueFd> files;  // at most kMaxWorkerFiles
};

constexpr std::size_t kMaxWorkerFiles = 4;  // RAW, JPEG and room for two more

// Packets above 64 KiB are refused: what is large travels as a file.
// Thread contract: Send and Close from any thread, Receive from one thread.
class WorkerLink {
 public:
  explicit WorkerLink(UniqueFd socket) : socket_(std::move(socket)) {}

  // Never waits longer than `patience` for a peer that does not read. Errors: failed.
  Status Send(const WorkerMessage& message,
              std::chrono::milliseconds patience = std::chrono::milliseconds(2000));
  // The next message; without a value when the time is over. Errors: failed (the peer is gone);
  // bad_input (a packet that is too long, no JSON object, or carries too many descriptors).
  Result<std::optional<WorkerMessage>> Receive(std::chrono::milliseconds timeout);
  // Wakes a waiting Receive, here and at the peer.
  void Close();

 private:
  UniqueFd socket_;
};

// Two connected sockets (AF_UNIX, SOCK_SEQPACKET: packets keep their bounds and their descriptors).
Result<std::pair<UniqueFd, UniqueFd>> WorkerSocketPair();

}  // namespace scan
