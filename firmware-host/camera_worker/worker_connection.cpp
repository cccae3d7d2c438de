#include "firmware-host/camera_worker/worker_connection.h"

#include <fmt/format.h>

#include <algorithm>

#include "firmware-host/protocol/rpc.h"

namespace scan {
namespace {

using SteadyClock = std::chrono::steady_clock;
constexpr char kWorkerWhere[] = "camera worker";

std::int64_t IdIn(const nlohmann::json& body, const char* key) {
  const auto id = body.find(key);
  return id != body.end() && id->is_number_integer() ? id->get<std::int64_t>() : 0;
}

}  // namespace

Result<std::unique_ptr<WorkerConnection>> WorkerConnection::Start(
    const CameraWorkerLauncher& launch, const WorkerLimits& limits) {
  SCAN_TRY(std::unique_ptr<CameraWorker> worker, launch());
  return std::unique_ptr<WorkerConnection>(new WorkerConnection(std::move(worker), limits));
}

WorkerConnection::WorkerConnection(std::unique_ptr<CameraWorker> worker, const WorkerLimits& limits)
    : worker_(std::move(worker)), link_(worker_->TakeSocket()), limits_(limits) {}

Error WorkerConnection::Lose(const std::string& what) {
  lost_ = true;
  return {ErrorKind::device, fmt::format("the camera worker {}; it {}", what, worker_->Kill()),
          kWorkerWhere,
          "check the camera and its cable; it is started again with the next picture"};
}

Result<WorkerMessage> WorkerConnection::Call(const char* function, nlohmann::json params,
                                             std::chrono::milliseconds limit,
                                             std::stop_token stop) {
  const std::int64_t id = next_id_++;
  const auto beat = std::max<std::int64_t>(limits_.silence.count() / 5, 10);
  WorkerMessage call;
  call.body = {{"id", id}, {"call", function}, {"beat_ms", beat}, {"params", std::move(params)}};
  if (const Status sent = link_.Send(call, limits_.silence); !sent)
    return tl::unexpected(Lose("does not listen (" + sent.error().what + ")"));
  // A worker that does not read it is found silent, or too slow.
  const std::stop_callback on_stop(stop, [this, id] {
    (void)link_.Send({{{"cancel", id}}, {}}, std::chrono::milliseconds(0));
  });
  return Await(id, function, limit, stop);
}

Result<WorkerMessage> WorkerConnection::Await(std::int64_t id, const char* function,
                                              std::chrono::milliseconds limit,
                                              std::stop_token stop) {
  constexpr std::chrono::milliseconds kSlice{50};  // how soon a requested stop is noticed
  auto deadline = SteadyClock::now() + limit;
  auto silent_since = SteadyClock::now();
  bool cancelled = false;
  while (true) {
    if (stop.stop_requested() && !cancelled) {
      cancelled = true;
      deadline = std::min(deadline, SteadyClock::now() + limits_.cancel);
    }
    auto message = link_.Receive(kSlice);
    if (!message && message.error().kind == ErrorKind::bad_input)
      return tl::unexpected(Lose("answered nonsense (" + message.error().what + ")"));
    if (!message) return tl::unexpected(Lose(fmt::format("died during {}", function)));
    const auto now = SteadyClock::now();
    if (*message) {
      nlohmann::json& body = (*message)->body;
      heard_ = true;
      if (IdIn(body, "beat") == id) silent_since = now;
      if (IdIn(body, "id") == id) {
        if (const auto error = body.find("error"); error != body.end())
          return tl::unexpected(ErrorFromJson(*error));
        if (const auto ok = body.find("ok"); ok != body.end() && ok->is_object()) {
          nlohmann::json answer = std::move(*ok);
          return WorkerMessage{std::move(answer), std::move((*message)->files)};
        }
        return tl::unexpected(Lose("answered nonsense (neither ok nor error)"));
      }
    }
    // A program that is still being loaded gives no sign of life yet.
    if (now < deadline && (!heard_ || now < silent_since + limits_.silence)) continue;
    const Error fault = Lose(now < deadline ? "gives no sign of life"
                                            : fmt::format("did not end {} in time", function));
    if (cancelled) return Cancelled(kWorkerWhere);
    return tl::unexpected(fault);
  }
}

}  // namespace scan
