#include "firmware-host/protocol/rpc_client.h"

#include "firmware-host/protocol/rpc.h"

namespace scan {

RpcClient::RpcClient(UniqueFd fd) : channel_(std::move(fd)), reader_([this] { ReadLoop(); }) {}

RpcClient::~RpcClient() { Close(); }

void RpcClient::Close() { channel_.Close(); }

void RpcClient::ReadLoop() {
  while (true) {
    auto message = channel_.Receive();
    const std::lock_guard lock(mutex_);
    if (!message) {
      closed_ = true;
      answered_.notify_all();
      return;
    }
    if (!*message || !(*message)->is_object()) continue;
    const Json& answer = **message;
    const Json id = answer.value("id", Json());
    if (!id.is_number_integer()) continue;
    if (const auto call = waiting_.find(id.get<std::int64_t>()); call != waiting_.end()) {
      call->second = answer;
      answered_.notify_all();
    }
  }
}

Result<Json> RpcClient::Call(const std::string& function, Json params,
                             std::optional<std::chrono::milliseconds> patience) {
  std::int64_t id = 0;
  {
    const std::lock_guard lock(mutex_);
    id = next_id_++;
    waiting_[id] = std::nullopt;
  }
  const Status sent =
      channel_.Send({{"id", id}, {"call", function}, {"params", std::move(params)}});
  std::unique_lock lock(mutex_);
  const auto done = [&] { return closed_ || waiting_[id].has_value(); };
  if (sent) {
    if (patience)
      answered_.wait_for(lock, *patience, done);
    else
      answered_.wait(lock, done);
  }
  const std::optional<Json> answer = std::move(waiting_[id]);
  waiting_.erase(id);
  if (answer && answer->contains("ok")) return (*answer)["ok"];
  if (answer && answer->contains("error"))
    return tl::unexpected<Error>(ErrorFromJson((*answer)["error"]));
  return Failed(closed_ || !sent ? "the connection was closed" : "no answer in time", function,
                "check that the other program still runs, then try again");
}

}  // namespace scan
