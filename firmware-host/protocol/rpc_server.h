// Listens on a Unix socket and serves every connection in a thread of its own.
#pragma once

#include <filesystem>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <thread>

#include "drivers/base/result.h"
#include "drivers/base/unique_fd.h"
#include "firmware-host/protocol/rpc.h"

namespace scan {

// At most 16 connections at a time; a further one is closed at once.
class RpcServer {
 public:
  // The functions and `on_lost` serve every connection (see ServeConnection). Errors: as
  // ListenUnix.
  static Result<std::unique_ptr<RpcServer>> Start(const std::filesystem::path& path,
                                                  RpcFunctions functions,
                                                  std::chrono::milliseconds silence_limit,
                                                  std::function<void()> on_lost = {});
  // The same where every connection has functions of its own: `connect` makes them, and they go
  // when the connection has ended. Thread contract: `connect` is called by the threads that serve.
  static Result<std::unique_ptr<RpcServer>> Start(const std::filesystem::path& path,
                                                  std::function<RpcFunctions()> connect,
                                                  std::chrono::milliseconds silence_limit,
                                                  std::function<void()> on_lost = {});
  ~RpcServer();  // ends all connections, removes the socket file

 private:
  struct Connection {
    explicit Connection(UniqueFd fd) : channel(std::move(fd)) {}
    Channel channel;
    std::jthread thread;
    bool ended = false;
  };

  RpcServer() = default;
  void AcceptLoop(std::stop_token stop);
  void DropEnded();

  std::filesystem::path path_;
  UniqueFd listener_;
  std::function<RpcFunctions()> connect_;
  std::chrono::milliseconds silence_limit_{0};
  std::function<void()> on_lost_;
  std::mutex mutex_;
  std::list<Connection> connections_;
  std::jthread acceptor_;
};

}  // namespace scan
