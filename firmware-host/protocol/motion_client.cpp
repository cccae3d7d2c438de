#include "firmware-host/protocol/motion_client.h"

#include <condition_variable>
#include <mutex>

#include "firmware-host/protocol/motion_messages.h"
#include "firmware-host/protocol/motion_server.h"

namespace scan {

MotionClient::MotionClient(UniqueFd fd)
    : client_(std::move(fd)), heartbeat_([this](std::stop_token stop) {
        std::mutex mutex;
        std::condition_variable_any wake;
        std::unique_lock lock(mutex);
        while (!wake.wait_for(lock, stop, kHeartbeatLimit / 4, [] { return false; })) {
          if (stop.stop_requested() || !client_.Call("heartbeat", Json::object(), kHeartbeatLimit))
            return;
        }
      }) {}

// A stop request is sent beside the running call, which then ends with its own answer: the position
// after the ramp stays known.
Result<Json> MotionClient::CallStoppable(const std::string& function, Json params,
                                         std::stop_token stop) {
  if (stop.stop_requested()) return Cancelled("motion");
  const std::stop_callback on_stop(stop, [this] { (void)Stop(); });
  return client_.Call(function, std::move(params));
}

Result<HomeReport> MotionClient::Home(std::stop_token stop) {
  SCAN_TRY(const Json answer, CallStoppable("home", Json::object(), stop));
  return HomeReportFromJson(answer);
}

Result<MoveReport> MotionClient::MoveTo(const StageTarget& target, std::stop_token stop) {
  SCAN_TRY(const Json answer, CallStoppable("move_to", ToJson(target), stop));
  return MoveReportFromJson(answer);
}

Status MotionClient::Stop() {
  SCAN_CHECK(client_.Call("stop", Json::object(), kHeartbeatLimit));
  return {};
}

Status MotionClient::Abort() {
  SCAN_CHECK(client_.Call("abort", Json::object(), kHeartbeatLimit));
  return {};
}

Status MotionClient::Acknowledge() {
  SCAN_CHECK(client_.Call("acknowledge", Json::object(), kHeartbeatLimit));
  return {};
}

MotionStatus MotionClient::ReadStatus() {
  const auto answer = client_.Call("status", Json::object(), kHeartbeatLimit);
  if (answer)
    if (const auto status = MotionStatusFromJson(*answer)) return *status;
  MotionStatus lost;
  lost.turntable = lost.lift = AxisState::fault;
  lost.fault = "scanstation-motiond does not answer";
  return lost;
}

}  // namespace scan
