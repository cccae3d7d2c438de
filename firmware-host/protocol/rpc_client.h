// Calls functions of another role over a channel.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "drivers/base/result.h"
#include "firmware-host/protocol/channel.h"

namespace scan {

// Thread contract: Call from any thread, several at a time; answers are matched by id.
class RpcClient {
 public:
  explicit RpcClient(UniqueFd fd);
  ~RpcClient();

  // Errors: those of the function called; failed when the connection ends or `patience` is over.
  Result<Json> Call(const std::string& function, Json params = Json::object(),
                    std::optional<std::chrono::milliseconds> patience = {});

  // Ends every waiting call with the error "the connection was closed".
  void Close();

 private:
  void ReadLoop();

  Channel channel_;
  std::mutex mutex_;
  std::condition_variable answered_;
  std::int64_t next_id_ = 1;
  bool closed_ = false;
  std::map<std::int64_t, std::optional<Json>> waiting_;
  std::jthread reader_;
};

}  // namespace scan
