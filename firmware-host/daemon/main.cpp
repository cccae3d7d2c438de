// scanstationd: runs captures on one station; its clients talk to it over a Unix socket.
#include <fmt/format.h>
#include <signal.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "drivers/base/files.h"
#include "drivers/base/log.h"
#include "drivers/base/sha256.h"
#include "drivers/station/station_file.h"
#include "firmware-host/daemon/capture_service.h"
#include "firmware-host/daemon/daemon_api.h"
#include "firmware-host/daemon/device_host.h"
#include "firmware-host/daemon/operator_prompt.h"
#include "firmware-host/daemon/page.h"
#include "firmware-host/daemon/session_from_config.h"
#include "firmware-host/daemon/sim_host.h"
#include "firmware-host/protocol/rpc_server.h"
#include "firmware-host/protocol/socket.h"

namespace scan {
namespace {

struct DaemonOptions {
  std::filesystem::path config;
  std::filesystem::path socket;
  std::filesystem::path motion_socket = "/run/scanstation/motiond.sock";
  std::filesystem::path truth;
  int page_port = 8380;  // -1: no page
};

RequestMaker MakeRequests(const StationConfig& config, StationHost& host) {
  return [&config, &host](const Json& params) -> Result<CaptureRequest> {
    if (!params.contains("out") || !params["out"].is_string())
      return BadInput("no session folder", "capture.out", "name one with --out");
    CaptureRequest request;
    request.folder = params["out"].get<std::string>();
    if (!request.folder.is_absolute())
      return BadInput("the session folder is a relative path", request.folder.string(),
                      "give an absolute one: the daemon works in another folder");
    request.resume = params.value("resume", false);
    SCAN_TRY(request.document,
             MakeSessionDocument(config, SessionIdFrom(request.folder.filename().string())));
    if (const auto bounds = host.specimen_bounds())
      request.framing = FramingCheck{.specimen = *bounds, .margin_px = 4};
    if (params.value("plates", true)) request.prompt = host.prompt();
    return request;
  };
}

bool IsSimulated(const StationConfig& config) {
  return config.motion_driver == MotionDriver::sim &&
         std::all_of(config.cameras.begin(), config.cameras.end(),
                     [](const CameraConfig& camera) { return camera.driver == CameraDriver::sim; });
}

// The one place that tells the simulated station from the real one.
Result<std::unique_ptr<StationHost>> StartHost(const DaemonOptions& options,
                                               const StationConfig& config,
                                               const std::string& config_sha256,
                                               OperatorPrompt& operator_prompt) {
  if (IsSimulated(config)) return SimHost::Start(config, options.truth);
  if (!options.truth.empty())
    return BadInput("nobody knows the truth of a real station", "--truth", "leave it out");
  return DeviceHost::Start(config, config_sha256, options.motion_socket, operator_prompt);
}

Result<std::unique_ptr<Page>> StartPage(const DaemonOptions& options, CaptureService& service,
                                        OperatorPrompt& operator_prompt) {
  if (options.page_port < 0) return std::unique_ptr<Page>();
  SCAN_TRY(auto page, Page::Start(options.page_port,
                                  {.status = [&service] { return service.ReadStatus(); },
                                   .stop = [&service] { service.Stop(); },
                                   .answer =
                                       [&operator_prompt](bool confirmed) {
                                         return operator_prompt.Answer(
                                             {.confirmed = confirmed, .note = "page"});
                                       },
                                   .last_picture = [&service] { return service.LastPicture(); }}));
  Log(LogLevel::info, "page", {{"url", fmt::format("http://127.0.0.1:{}/", page->port())}});
  return page;
}

Status Serve(const DaemonOptions& options) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);  // before any thread: all inherit it

  SCAN_TRY(const std::string text, ReadTextFile(options.config));
  SCAN_TRY(const StationConfig config, ParseStationConfig(text, options.config.string()));
  OperatorPrompt operator_prompt;
  SCAN_TRY(const auto host, StartHost(options, config, Sha256Hex(AsBytes(text)), operator_prompt));
  CaptureService service(host->station(), operator_prompt);
  SCAN_TRY(const auto page, StartPage(options, service, operator_prompt));
  SCAN_TRY(const auto server,
           RpcServer::Start(options.socket,
                            DaemonFunctions(service, operator_prompt, MakeRequests(config, *host),
                                            [] { ::kill(::getpid(), SIGTERM); }),
                            std::chrono::milliseconds(0)));
  Log(LogLevel::info, "ready", {{"socket", options.socket.string()}, {"station", config.name}});
  int signal = 0;
  sigwait(&signals, &signal);
  Log(LogLevel::info, "shutdown");
  return {};
}

}  // namespace
}  // namespace scan

int main(int argc, char** argv) {
  scan::DaemonOptions options;
  options.socket = scan::DefaultSocket();
  CLI::App app("scanstationd: runs captures on one station");
  app.set_version_flag("--version", SCAN_VERSION);
  app.add_option("--config", options.config, "station file (configs/*.toml)")->required();
  app.add_option("--socket", options.socket, "Unix socket to listen on")->capture_default_str();
  app.add_option("--motion-socket", options.motion_socket,
                 "Unix socket of scanstation-motiond; a simulated station has its own")
      ->capture_default_str();
  app.add_option("--page-port", options.page_port,
                 "port of the page on 127.0.0.1; 0: any, -1: none")
      ->capture_default_str();
  app.add_option("--truth", options.truth,
                 "simulation only: write the true camera of every frame here");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  if (const auto served = scan::Serve(options); !served) {
    fmt::print(stderr, "scanstationd: {}\n", ToString(served.error()));
    return ExitCode(served.error());
  }
  return 0;
}
