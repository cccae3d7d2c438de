#include "firmware-host/protocol/rpc_server.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <condition_variable>
#include <optional>

#include "firmware-host/protocol/socket.h"

namespace scan {
namespace {

constexpr std::size_t kMaxConnections = 16;
constexpr std::chrono::milliseconds kPollInterval{100};

ErrorKind KindFromName(const std::string& name) {
  if (name == "bad_input") return ErrorKind::bad_input;
  if (name == "cancelled") return ErrorKind::cancelled;
  if (name == "device") return ErrorKind::device;
  return ErrorKind::failed;
}

std::string KindName(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::bad_input:
      return "bad_input";
    case ErrorKind::cancelled:
      return "cancelled";
    case ErrorKind::device:
      return "device";
    case ErrorKind::failed:
      return "failed";
  }
  return "failed";
}

Json Answer(const Json& id, const Result<Json>& result) {
  Json answer = {{"id", id}};
  if (result)
    answer["ok"] = *result;
  else
    answer["error"] = ErrorToJson(result.error());
  return answer;
}

// A function that reads a parameter of the wrong type throws: the one place where that ends.
Json AnswerOf(const Json& id, const RpcFunction& function, const Json& params,
              std::stop_token stop) {
  try {
    return Answer(id, function.run(params, std::move(stop)));
  } catch (const nlohmann::json::exception& e) {
    return Answer(id, BadInput(std::string("a parameter has the wrong type: ") + e.what(), "params",
                               "use a client of the same version"));
  }
}

// Runs the calls that take time, one at a time; a second one while one runs is refused.
class SlowLane {
 public:
  explicit SlowLane(Channel& channel)
      : channel_(channel), thread_([this](std::stop_token stop) { Run(stop); }) {}

  bool Offer(std::function<Json(std::stop_token)> job) {
    const std::lock_guard lock(mutex_);
    if (job_ || busy_) return false;
    job_ = std::move(job);
    job_stop_ = std::stop_source();
    wake_.notify_one();
    return true;
  }

  // A call waits or runs, and nothing has cancelled it.
  bool Working() {
    const std::lock_guard lock(mutex_);
    return (job_ || busy_) && !job_stop_.stop_requested();
  }

  void CancelJob() {
    std::stop_source current;  // requested outside the lock: callbacks may take their time
    {
      const std::lock_guard lock(mutex_);
      current = job_stop_;
    }
    current.request_stop();
  }

 private:
  void Run(std::stop_token stop) {
    const std::stop_callback on_end(stop, [this] { CancelJob(); });
    while (true) {
      std::function<Json(std::stop_token)> job;
      std::stop_token job_stop;
      {
        std::unique_lock lock(mutex_);
        busy_ = false;
        if (!wake_.wait(lock, stop, [this] { return bool(job_); })) return;
        job = std::exchange(job_, nullptr);
        busy_ = true;
        job_stop = job_stop_.get_token();
      }
      const Json answer = job(job_stop);
      // Free before the answer is out: the peer may send its next call at once.
      {
        const std::lock_guard lock(mutex_);
        busy_ = false;
      }
      (void)channel_.Send(answer);  // a dead peer shows itself to the reader
    }
  }

  Channel& channel_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::function<Json(std::stop_token)> job_;
  std::stop_source job_stop_;
  bool busy_ = false;
  std::jthread thread_;  // last: it uses all of the above
};

Status Dispatch(const Json& request, const RpcFunctions& functions, Channel& channel,
                SlowLane& slow, std::stop_token stop) {
  const Json id = request.is_object() ? request.value("id", Json()) : Json();
  const std::string call =
      request.is_object() && request.contains("call") && request["call"].is_string()
          ? request["call"].get<std::string>()
          : std::string();
  const auto found = functions.find(call);
  if (found == functions.end())
    return channel.Send(Answer(id, BadInput("unknown call '" + call + "'", "request",
                                            "use a client of the same version")));
  const Json params = request.value("params", Json::object());
  const RpcFunction& function = found->second;
  if (function.cancels) slow.CancelJob();
  if (function.immediate) return channel.Send(AnswerOf(id, function, params, stop));
  const bool taken = slow.Offer([&function, params, id](std::stop_token lane_stop) {
    return AnswerOf(id, function, params, lane_stop);
  });
  if (taken) return {};
  return channel.Send(
      Answer(id, BadInput("busy with another call", call, "wait for its answer or send stop")));
}

}  // namespace

Json ErrorToJson(const Error& error) {
  return {{"kind", KindName(error.kind)},
          {"what", error.what},
          {"where", error.where},
          {"mend", error.mend}};
}

Error ErrorFromJson(const Json& json) {
  const auto text = [&json](const char* key) {
    return json.is_object() && json.contains(key) && json[key].is_string()
               ? json[key].get<std::string>()
               : std::string();
  };
  return {KindFromName(text("kind")), text("what"), text("where"), text("mend")};
}

void ServeConnection(Channel& channel, const RpcFunctions& functions,
                     std::chrono::milliseconds silence_limit, std::stop_token stop,
                     const std::function<void()>& on_lost) {
  SlowLane slow(channel);
  auto last_heard = std::chrono::steady_clock::now();
  while (!stop.stop_requested()) {
    auto request = channel.Receive(kPollInterval);
    if (!request) break;
    const auto now = std::chrono::steady_clock::now();
    if (!*request) {
      if (silence_limit.count() > 0 && now - last_heard > silence_limit) break;
      continue;
    }
    last_heard = now;
    if (!Dispatch(**request, functions, channel, slow, stop)) break;
  }
  if (on_lost && !stop.stop_requested() && slow.Working()) on_lost();
}

Result<std::unique_ptr<RpcServer>> RpcServer::Start(const std::filesystem::path& path,
                                                    RpcFunctions functions,
                                                    std::chrono::milliseconds silence_limit,
                                                    std::function<void()> on_lost) {
  return Start(
      path, [functions = std::move(functions)] { return functions; }, silence_limit,
      std::move(on_lost));
}

Result<std::unique_ptr<RpcServer>> RpcServer::Start(const std::filesystem::path& path,
                                                    std::function<RpcFunctions()> connect,
                                                    std::chrono::milliseconds silence_limit,
                                                    std::function<void()> on_lost) {
  std::unique_ptr<RpcServer> server(new RpcServer);
  SCAN_TRY(server->listener_, ListenUnix(path));
  server->path_ = path;
  server->connect_ = std::move(connect);
  server->silence_limit_ = silence_limit;
  server->on_lost_ = std::move(on_lost);
  server->acceptor_ =
      std::jthread([raw = server.get()](std::stop_token stop) { raw->AcceptLoop(stop); });
  return server;
}

RpcServer::~RpcServer() {
  acceptor_ = {};
  for (Connection& connection : connections_) {
    connection.thread.request_stop();
    connection.channel.Close();
  }
  connections_.clear();
  ::unlink(path_.c_str());
}

void RpcServer::AcceptLoop(std::stop_token stop) {
  while (!stop.stop_requested()) {
    pollfd descriptor{listener_.get(), POLLIN, 0};
    if (::poll(&descriptor, 1, static_cast<int>(kPollInterval.count())) <= 0) {
      DropEnded();
      continue;
    }
    UniqueFd fd(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
    DropEnded();
    if (!fd || connections_.size() >= kMaxConnections) continue;
    Connection& connection = connections_.emplace_back(std::move(fd));
    connection.thread = std::jthread([this, &connection](std::stop_token connection_stop) {
      {
        const RpcFunctions functions = connect_();
        ServeConnection(connection.channel, functions, silence_limit_, connection_stop, on_lost_);
      }
      connection.channel.Close();
      const std::lock_guard lock(mutex_);
      connection.ended = true;
    });
  }
}

void RpcServer::DropEnded() {
  std::list<Connection> ended;  // declared before the lock: joined after it is released
  const std::lock_guard lock(mutex_);
  for (auto it = connections_.begin(); it != connections_.end();) {
    const auto next = std::next(it);
    if (it->ended) ended.splice(ended.end(), connections_, it);
    it = next;
  }
}

}  // namespace scan
