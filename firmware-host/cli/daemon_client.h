// The command line's side of scanstationd's socket.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <stop_token>

#include "drivers/base/progress.h"
#include "drivers/base/result.h"
#include "firmware-host/protocol/rpc_client.h"

namespace scan {

// For its answer to a call.
inline constexpr std::chrono::milliseconds kDaemonPatience{10000};

Result<std::unique_ptr<RpcClient>> ConnectDaemon(
    const std::filesystem::path& socket,
    std::chrono::milliseconds patience = std::chrono::milliseconds(0));

// Starts a capture and follows it to its end; the station's questions are put to the terminal. A
// requested stop token stops the station. Returns the daemon's last status. Errors: bad_input for a
// refused request, cancelled, device or failed when the capture did not complete.
Result<Json> CaptureAndFollow(RpcClient& daemon, const Json& params, const ProgressFn& progress,
                              std::stop_token stop);

}  // namespace scan
