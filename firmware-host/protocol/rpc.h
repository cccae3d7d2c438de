// Requests and answers: {"id":1,"call":"move_to","params":{}} and {"id":1,"ok":{}} or
// {"id":1,"error":{"kind","what","where","mend"}}.
#pragma once

#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>

#include "drivers/base/result.h"
#include "firmware-host/protocol/channel.h"

namespace scan {

Json ErrorToJson(const Error& error);
Error ErrorFromJson(const Json& json);

// One function a peer may call. Immediate ones answer in the reading thread, so that a stop is
// never queued behind a move; the others run one at a time and get a stop token that is requested
// when the connection ends or when a function that `cancels` arrives, be it before they have begun.
struct RpcFunction {
  std::function<Result<Json>(const Json& params, std::stop_token stop)> run;
  bool immediate = true;
  bool cancels = false;
};
using RpcFunctions = std::map<std::string, RpcFunction>;

// Serves one connection until the peer closes it or `stop` is requested. `silence_limit` ends the
// connection when the peer sends nothing for so long (0: no limit): the heartbeat. `on_lost` (may
// be empty) is told, before the call's token is requested, of a peer that went or fell silent
// during a call that is not immediate and that nothing has cancelled. Thread contract: blocks its
// thread, which also calls `on_lost`; starts one more for calls that are not immediate.
void ServeConnection(Channel& channel, const RpcFunctions& functions,
                     std::chrono::milliseconds silence_limit, std::stop_token stop,
                     const std::function<void()>& on_lost = {});

}  // namespace scan
