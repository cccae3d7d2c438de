#include "firmware-host/cli/daemon_client.h"

#include <thread>

#include "firmware-host/cli/operator_dialogue.h"
#include "firmware-host/protocol/rpc.h"
#include "firmware-host/protocol/socket.h"

namespace scan {
namespace {

constexpr std::chrono::milliseconds kPollInterval{100};

Result<Json> Outcome(const Json& status, const std::string& session) {
  const std::string outcome = status.value("outcome", "");
  if (outcome == "complete") return status;
  if (outcome == "cancelled") return Cancelled("capture of " + session);
  if (status.contains("error")) return tl::unexpected<Error>(ErrorFromJson(status["error"]));
  std::string failed;
  for (const Json& view : status["failed"])
    failed += " " + view.value("view", "") + " (" + view.value("reason", "") + ")";
  return Failed("the capture ended " + outcome + "; failed views:" + failed, session,
                "see the session's log, then: scanstation resume");
}

}  // namespace

Result<std::unique_ptr<RpcClient>> ConnectDaemon(const std::filesystem::path& socket,
                                                 std::chrono::milliseconds patience) {
  SCAN_TRY(UniqueFd fd, ConnectUnix(socket, patience));
  return std::make_unique<RpcClient>(std::move(fd));
}

Result<Json> CaptureAndFollow(RpcClient& daemon, const Json& params, const ProgressFn& progress,
                              std::stop_token stop) {
  SCAN_CHECK(daemon.Call("capture", params, kDaemonPatience));
  const std::stop_callback on_stop(
      stop, [&daemon] { (void)daemon.Call("stop", Json::object(), kDaemonPatience); });
  OperatorDialogue dialogue;
  while (true) {
    SCAN_TRY(const Json status, daemon.Call("status", Json::object(), kDaemonPatience));
    const double count = status.value("view_count", 0);
    const double done = status.value("views_accepted", 0.0) + status.value("views_failed", 0.0);
    Report(progress, "capture", count > 0 ? done / count : 0);
    dialogue.Follow(daemon, status.value("question", ""));
    if (status.value("state", "") == "idle") return Outcome(status, params.value("out", ""));
    std::this_thread::sleep_for(kPollInterval);
  }
}

}  // namespace scan
