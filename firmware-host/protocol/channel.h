// A connected stream socket that carries one JSON document a line.
#pragma once

#include <chrono>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "drivers/base/result.h"
#include "drivers/base/unique_fd.h"

namespace scan {

using Json = nlohmann::json;

// Lines above 1 MiB are refused, so that a peer cannot make us hold any amount of memory.
// Thread contract: Send and Close from any thread, Receive from one thread.
class Channel {
 public:
  explicit Channel(UniqueFd fd) : fd_(std::move(fd)) {}

  Status Send(const Json& message);
  // Waits for the next document; without a value when the time is over. Errors: the peer closed,
  // the line is too long or no JSON.
  Result<std::optional<Json>> Receive(std::optional<std::chrono::milliseconds> timeout = {});
  // Wakes a waiting Receive; the descriptor itself is closed by the destructor.
  void Close();

 private:
  UniqueFd fd_;
  std::mutex send_mutex_;
  std::string buffer_;
};

}  // namespace scan
