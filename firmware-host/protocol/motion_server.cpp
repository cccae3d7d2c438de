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
                                                   Motion& motion, const StationIdentity& station) {
  RpcFunctions functions = MotionFunctions(motion);
  functions["describe"] = {[station](const Json&, std::stop_token) -> Result<Json> {
    return Json{{"station", station.name}, {"config_sha256", station.config_sha256}};
  }};
  return RpcServer::Start(socket, std::move(functions), kHeartbeatLimit, OnPeerLost(motion));
}

}  // namespace scan
