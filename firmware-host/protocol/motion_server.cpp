#include "firmware-host/protocol/motion_server.h"

#include <memory>
#include <mutex>

#include "drivers/base/log.h"
#include "firmware-host/protocol/motion_messages.h"

namespace scan {
namespace {

Result<Json> Done(const Status& status) {
  SCAN_CHECK(status);
  return Json::object();
}

// One client moves at a time, whichever connection it came by.
template <class Move>
Result<Json> MoveAlone(std::mutex& moving, Move move) {
  const std::unique_lock lock(moving, std::try_to_lock);
  if (!lock)
    return BadInput("another client moves the stage", "motion", "wait for it or send stop");
  return move();
}

// Who has switched the lamp on; shared by all connections.
class LampDesk {
 public:
  explicit LampDesk(const ServedLamp& served) : served_(served) {}

  Result<Json> Set(const void* client, const Json& params) {
    if (!served_.lamp) {
      return BadInput("the station has no lamp", "light.driver", "name it in the station file");
    }
    double level = served_.level;
    if (params.contains("level")) {
      level = params.at("level").get<double>();
    } else if (!params.at("on").get<bool>()) {
      level = 0;
    }
    const std::lock_guard lock(mutex_);
    if (holder_ && holder_ != client) {
      return BadInput("another client has switched the light on", "light",
                      "wait until it has ended");
    }
    SCAN_CHECK(served_.lamp->SetLevel(level));
    holder_ = level > 0 ? client : nullptr;
    return Json{{"level", level}, {"settle_ms", level > 0 ? served_.settle_ms : 0}};
  }

  // Law: who switched it on has gone, so it goes dark.
  void Leave(const void* client) {
    const std::lock_guard lock(mutex_);
    if (holder_ != client) return;
    holder_ = nullptr;
    const Status dark = served_.lamp->SetLevel(0);
    Log(dark ? LogLevel::info : LogLevel::error, "light_off",
        {{"cause", "its client has gone"}, {"error", dark ? "" : ToString(dark.error())}});
  }

 private:
  const ServedLamp served_;
  std::mutex mutex_;
  const void* holder_ = nullptr;
};

// One connection's right to the lamp; ends with it.
class LampClient {
 public:
  explicit LampClient(std::shared_ptr<LampDesk> desk) : desk_(std::move(desk)) {}
  ~LampClient() { desk_->Leave(this); }
  LampClient(const LampClient&) = delete;
  LampClient& operator=(const LampClient&) = delete;
  Result<Json> Set(const Json& params) { return desk_->Set(this, params); }

 private:
  std::shared_ptr<LampDesk> desk_;
};

}  // namespace

RpcFunctions MotionFunctions(Motion& motion) {
  RpcFunctions functions;
  const auto moving = std::make_shared<std::mutex>();
  functions["home"] = {[&motion, moving](const Json&, std::stop_token stop) {
                         return MoveAlone(*moving, [&]() -> Result<Json> {
                           SCAN_TRY(const HomeReport report, motion.Home(stop));
                           return ToJson(report);
                         });
                       },
                       /*immediate=*/false};
  functions["move_to"] = {[&motion, moving](const Json& params, std::stop_token stop) {
                            return MoveAlone(*moving, [&]() -> Result<Json> {
                              SCAN_TRY(const StageTarget target, StageTargetFromJson(params));
                              SCAN_TRY(const MoveReport report, motion.MoveTo(target, stop));
                              return ToJson(report);
                            });
                          },
                          /*immediate=*/false};
  functions["stop"] = {[&motion](const Json&, std::stop_token) { return Done(motion.Stop()); },
                       /*immediate=*/true, /*cancels=*/true};
  functions["abort"] = {[&motion](const Json&, std::stop_token) { return Done(motion.Abort()); },
                        /*immediate=*/true, /*cancels=*/true};
  functions["acknowledge"] = {
      [&motion](const Json&, std::stop_token) { return Done(motion.Acknowledge()); }};
  functions["status"] = {[&motion](const Json&, std::stop_token) -> Result<Json> {
    return ToJson(motion.ReadStatus());
  }};
  functions["heartbeat"] = {
      [](const Json&, std::stop_token) -> Result<Json> { return Json::object(); }};
  return functions;
}

std::function<void()> OnPeerLost(Motion& motion) {
  return [&motion] {
    Log(LogLevel::warning, "peer_lost_while_moving", {{"action", "stop"}});
    (void)motion.LoseHeartbeat();
  };
}

void ServeMotion(Channel& channel, Motion& motion, std::stop_token stop) {
  ServeConnection(channel, MotionFunctions(motion), kHeartbeatLimit, stop, OnPeerLost(motion));
  (void)motion.Stop();
}

Result<std::unique_ptr<RpcServer>> ListenForMotion(const std::filesystem::path& socket,
                                                   Motion& motion, const StationIdentity& station,
                                                   const ServedLamp& lamp) {
  RpcFunctions functions = MotionFunctions(motion);
  functions["describe"] = {[station](const Json&, std::stop_token) -> Result<Json> {
    return Json{{"station", station.name}, {"config_sha256", station.config_sha256}};
  }};
  auto connect = [functions, desk = std::make_shared<LampDesk>(lamp)] {
    RpcFunctions own = functions;
    own["set_light"] = {[client = std::make_shared<LampClient>(desk)](
                            const Json& params, std::stop_token) { return client->Set(params); }};
    return own;
  };
  return RpcServer::Start(socket, std::function<RpcFunctions()>(std::move(connect)),
                          kHeartbeatLimit, OnPeerLost(motion));
}

}  // namespace scan
