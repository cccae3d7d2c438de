// Serves a Motion to other roles: the core of scanstation-motiond.
#pragma once

#include "drivers/motion/motion.h"
#include "firmware-host/protocol/rpc.h"

namespace scan {

// A peer that says nothing for so long has died: its motion is stopped.
constexpr std::chrono::milliseconds kHeartbeatLimit{2000};

// home, move_to (one at a time); stop, abort, acknowledge, status, heartbeat (answered at once).
// Precondition: `motion` outlives the functions.
RpcFunctions MotionFunctions(Motion& motion);

// Serves one peer; when it goes or falls silent while something moves, the motion is stopped.
void ServeMotion(Channel& channel, Motion& motion, std::stop_token stop);

}  // namespace scan
