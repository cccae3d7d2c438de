#include "firmware-host/camera_worker/serve_camera.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>

#include "drivers/base/log.h"
#include "firmware-host/camera_worker/worker_process.h"
#include "firmware-host/protocol/rpc.h"

namespace scan {
namespace {

using namespace std::chrono_literals;

constexpr std::chrono::milliseconds kIdlePoll{1000};

struct Call {
  std::int64_t id = 0;
  std::string function;
  Json params;
  std::chrono::milliseconds beat{500};
};

// Runs the calls one at a time on a thread of its own, which alone touches the camera.
class CallLane {
 public:
  CallLane(WorkerLink& link, const CameraWorkerRole& role) : link_(link), role_(role) {
    thread_ = std::jthread([this](std::stop_token stop) { Run(stop); });
  }

  void Offer(Call call) {
    const std::lock_guard lock(mutex_);
    if (running_) {
      Answer(call.id, BadInput("a call runs already", call.function, "send one at a time"));
      return;
    }
    running_ = std::move(call);
    fresh_ = true;
    stop_ = std::stop_source();
    changed_.notify_all();
  }

  // The call that runs, for its heartbeat.
  std::optional<Call> Running() {
    const std::lock_guard lock(mutex_);
    return running_;
  }

  // Requests the call's token; id 0 means whichever runs.
  void Cancel(std::int64_t id) {
    std::stop_source stop;  // requested outside the lock: callbacks may take their time
    {
      const std::lock_guard lock(mutex_);
      if (!running_ || (id != 0 && running_->id != id)) return;
      stop = stop_;
    }
    stop.request_stop();
  }

  // Whether no call runs any more.
  bool WaitIdle(std::chrono::milliseconds patience) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, patience, [this] { return !running_; });
  }

 private:
  void Run(std::stop_token stop) {
    while (true) {
      Call call;
      std::stop_token call_stop;
      {
        std::unique_lock lock(mutex_);
        if (!changed_.wait(lock, stop, [this] { return fresh_; })) break;
        fresh_ = false;
        call = *running_;
        call_stop = stop_.get_token();
      }
      Result<WorkerMessage> result = Perform(call, call_stop);
      const std::lock_guard lock(mutex_);
      Answer(call.id, std::move(result));
      running_.reset();
      changed_.notify_all();
    }
    camera_.reset();  // on the thread that opened it
  }

  Result<WorkerMessage> Perform(const Call& call, std::stop_token stop) {
    try {
      if (call.function == "open") return Open(call.params);
      if (call.function == "list" && role_.list) {
        SCAN_TRY(const auto cameras, role_.list());
        return WorkerMessage{ToJson(cameras), {}};
      }
      if (!camera_) return BadInput("there is no open camera", call.function, "open it first");
      if (call.function == "configure") {
        SCAN_TRY(const CameraSettings settings, CameraSettingsFromJson(call.params));
        SCAN_TRY(const AppliedSettings applied, camera_->Configure(settings));
        return WorkerMessage{ToJson(applied), {}};
      }
      if (call.function == "grab") {
        SCAN_TRY(const Frame frame, camera_->Grab(std::move(stop)));
        return PackFrame(frame);
      }
    } catch (const nlohmann::json::exception& e) {
      return BadInput(std::string("a parameter has the wrong type: ") + e.what(), call.function,
                      "use programs of the same version");
    }
    return BadInput("there is no such function", call.function, "use programs of the same version");
  }

  Result<WorkerMessage> Open(const Json& params) {
    camera_.reset();
    SCAN_TRY(camera_, role_.open(params.at("options").get<std::string>()));
    return WorkerMessage{ToJson(camera_->Info()), {}};
  }

  void Answer(std::int64_t id, Result<WorkerMessage> result) {
    WorkerMessage answer;
    answer.body["id"] = id;
    if (result) {
      answer.body["ok"] = std::move(result->body);
      answer.files = std::move(result->files);
    } else {
      answer.body["error"] = ErrorToJson(result.error());
    }
    Status sent = link_.Send(answer);
    if (!sent && sent.error().kind == ErrorKind::bad_input)  // too long: that can be said
      sent = link_.Send({{{"id", id}, {"error", ErrorToJson(sent.error())}}, {}});
    if (!sent) Log(LogLevel::warning, "answer_lost", {{"error", ToString(sent.error())}});
  }

  WorkerLink& link_;
  const CameraWorkerRole& role_;
  std::unique_ptr<Camera> camera_;  // of the lane's thread
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<Call> running_;
  bool fresh_ = false;  // running_ has not begun
  std::stop_source stop_;
  std::jthread thread_;  // joined first
};

std::optional<Call> CallFrom(const Json& body) {
  const auto id = body.find("id"), function = body.find("call"), params = body.find("params");
  if (id == body.end() || !id->is_number_integer() || function == body.end() ||
      !function->is_string() || params == body.end() || !params->is_object())
    return {};
  Call call{id->get<std::int64_t>(), function->get<std::string>(), *params, 500ms};
  if (const auto beat = body.find("beat_ms"); beat != body.end() && beat->is_number_integer())
    call.beat =
        std::chrono::milliseconds(std::clamp<std::int64_t>(beat->get<std::int64_t>(), 10, 2000));
  return call;
}

}  // namespace

void ServeCamera(UniqueFd socket, const CameraWorkerRole& role,
                 const std::function<void()>& on_stuck) {
  WorkerLink link(std::move(socket));
  CallLane lane(link, role);
  while (true) {
    const auto running = lane.Running();
    const auto message = link.Receive(running ? running->beat : kIdlePoll);
    if (!message) break;
    if (!*message) {
      // A beat that finds no room is not missed: the owner has enough of them to read.
      if (running) (void)link.Send({{{"beat", running->id}}, {}}, 0ms);
      continue;
    }
    const Json& body = (*message)->body;
    if (const auto cancel = body.find("cancel");
        cancel != body.end() && cancel->is_number_integer())
      lane.Cancel(cancel->get<std::int64_t>());
    else if (auto call = CallFrom(body))
      lane.Offer(std::move(*call));
  }
  lane.Cancel(0);
  if (!lane.WaitIdle(3000ms) && on_stuck) on_stuck();
}

int CameraWorkerMain(const CameraWorkerRole& role, const char* program) {
  int type = 0;
  socklen_t size = sizeof type;
  const bool started_by_owner =
      ::getsockopt(kWorkerSocketFd, SOL_SOCKET, SO_TYPE, &type, &size) == 0 &&
      type == SOCK_SEQPACKET;
  if (started_by_owner) {
    ServeCamera(UniqueFd(kWorkerSocketFd), role, [] { ::_exit(1); });
    return 0;
  }
  fmt::print("{}: a camera in a process of its own, started by the programs of scanstation\n",
             program);
  if (!role.list) return 0;
  const auto cameras = role.list();
  if (!cameras) {
    fmt::print(stderr, "{}: {}\n", program, ToString(cameras.error()));
    return ExitCode(cameras.error());
  }
  for (const CameraListing& camera : *cameras) {
    fmt::print("{}  {}\n", camera.id, camera.model);
    for (const std::string& detail : camera.details) fmt::print("  {}\n", detail);
  }
  return 0;
}

}  // namespace scan
