// Serves a Motion to other roles: the core of scanstation-motiond.
#pragma once

#include <string>

#include "drivers/io/lamp.h"
#include "drivers/motion/motion.h"
#include "firmware-host/protocol/rpc_server.h"

namespace scan {

// A peer that says nothing for so long has died: the motion that it asked for is stopped.
constexpr std::chrono::milliseconds kHeartbeatLimit{2000};

// home, move_to (one at a time); stop, abort, acknowledge, status, heartbeat (answered at once).
// Precondition: `motion` outlives the functions.
RpcFunctions MotionFunctions(Motion& motion);

// Logs that the peer whose motion runs has gone or fallen silent, and raises that interlock.
// Precondition: `motion` outlives the function.
std::function<void()> OnPeerLost(Motion& motion);

// Serves one peer; when it ends, a motion that runs is stopped.
void ServeMotion(Channel& channel, Motion& motion, std::stop_token stop);

// Which station file the server runs with, so that a client can tell whether it has read the same.
struct StationIdentity {
  std::string name;
  std::string config_sha256;  // of the file's bytes
};

// The station's lamp, and what "on" means.
struct ServedLamp {
  Lamp* lamp = nullptr;  // null: the station has none
  double level = 1;
  double settle_ms = 0;
};

// Listens on a Unix socket for many peers; `describe` answers with the station. The lamp belongs to
// the client that switched it on until it switches it off, or has gone or fallen silent: then it
// goes dark. Preconditions: `motion` and the lamp outlive the server. Errors: as RpcServer::Start.
Result<std::unique_ptr<RpcServer>> ListenForMotion(const std::filesystem::path& socket,
                                                   Motion& motion, const StationIdentity& station,
                                                   const ServedLamp& lamp = {});

}  // namespace scan
