#include "firmware-host/protocol/motion_client.h"

#include <cmath>
#include <condition_variable>
#include <mutex>

#include "firmware-host/protocol/motion_messages.h"
#include "firmware-host/protocol/motion_server.h"

namespace scan {

MotionLink::MotionLink(UniqueFd fd)
    : client_(std::move(fd)), heartbeat_([this](std::stop_token stop) {
        std::mutex mutex;
        std::condition_variable_any wake;
        std::unique_lock lock(mutex);
        while (!wake.wait_for(lock, stop, kHeartbeatLimit / 4, [] { return false; })) {
          if (stop.stop_requested() || !client_.Call("heartbeat", Json::object(), kHeartbeatLimit))
            return;
        }
      }) {}

namespace {

class LightClient final : public Light {
 public:
  LightClient(std::shared_ptr<MotionLink> link, std::shared_ptr<Clock> clock)
      : link_(std::move(link)), clock_(std::move(clock)) {}

  Status Set(bool on) override {
    SCAN_TRY(const Json answer,
             link_->client().Call("set_light", Json{{"on", on}}, kHeartbeatLimit));
    SCAN_TRY(const double settle_ms, SettleMsFromJson(answer));
    clock_->SleepFor(std::llround(settle_ms * 1e6));
    return {};
  }

 private:
  std::shared_ptr<MotionLink> link_;
  std::shared_ptr<Clock> clock_;
};

}  // namespace

MotionClient::MotionClient(UniqueFd fd) : link_(std::make_shared<MotionLink>(std::move(fd))) {}

std::unique_ptr<Light> MotionClient::MakeLight(std::shared_ptr<Clock> clock) {
  return std::make_unique<LightClient>(link_, std::move(clock));
}

Status MotionClient::SetLightLevel(double level) {
  SCAN_CHECK(link_->client().Call("set_light", Json{{"level", level}}, kHeartbeatLimit));
  return {};
}

// A stop request is sent beside the running call, which then ends with its own answer: the position
// after the ramp stays known.
Result<Json> MotionClient::CallStoppable(const std::string& function, Json params,
                                         std::stop_token stop) {
  if (stop.stop_requested()) return Cancelled("motion");
  const std::stop_callback on_stop(stop, [this] { (void)Stop(); });
  return link_->client().Call(function, std::move(params));
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
  SCAN_CHECK(link_->client().Call("stop", Json::object(), kHeartbeatLimit));
  return {};
}

Status MotionClient::Abort() {
  SCAN_CHECK(link_->client().Call("abort", Json::object(), kHeartbeatLimit));
  return {};
}

Status MotionClient::Acknowledge() {
  SCAN_CHECK(link_->client().Call("acknowledge", Json::object(), kHeartbeatLimit));
  return {};
}

MotionStatus MotionClient::ReadStatus() {
  const auto answer = link_->client().Call("status", Json::object(), kHeartbeatLimit);
  if (answer)
    if (const auto status = MotionStatusFromJson(*answer)) return *status;
  MotionStatus lost;
  lost.turntable = lost.lift = AxisState::fault;
  lost.fault = "scanstation-motiond does not answer";
  return lost;
}

}  // namespace scan
