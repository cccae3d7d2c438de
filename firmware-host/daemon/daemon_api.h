// What a client may ask of scanstationd.
#pragma once

#include <functional>

#include "firmware-host/daemon/capture_service.h"
#include "firmware-host/protocol/rpc.h"

namespace scan {

// Makes the capture request of {"out": PATH, "resume": bool, "specimen": {...}}.
using RequestMaker = std::function<Result<CaptureRequest>(const Json& params)>;

// capture, stop, pause, resume, status, shutdown.
// Preconditions: `service` outlives the functions; `on_shutdown` only sets a flag.
RpcFunctions DaemonFunctions(CaptureService& service, RequestMaker make_request,
                             std::function<void()> on_shutdown);

}  // namespace scan
