// What a client may ask of scanstationd.
#pragma once

#include <functional>

#include "firmware-host/daemon/capture_service.h"
#include "firmware-host/protocol/rpc.h"

namespace scan {

// Makes the capture request of {"out": PATH, "resume": bool, "plates": bool}; without plates nobody
// is asked to take the specimen away.
using RequestMaker = std::function<Result<CaptureRequest>(const Json& params)>;

// capture, stop, pause, resume, answer {"confirmed": bool, "note": TEXT}, status, shutdown.
// Preconditions: `service` and `operator_prompt` outlive the functions; `on_shutdown` only sets a
// flag.
RpcFunctions DaemonFunctions(CaptureService& service, OperatorPrompt& operator_prompt,
                             RequestMaker make_request, std::function<void()> on_shutdown);

}  // namespace scan
