// scanstationd: runs captures on one station; its clients talk to it over a Unix socket.
#include <fmt/format.h>
#include <signal.h>

#include <CLI/CLI.hpp>
#include <atomic>

#include "drivers/base/log.h"
#include "drivers/station/station_file.h"
#include "firmware-host/daemon/capture_service.h"
#include "firmware-host/daemon/daemon_api.h"
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
  std::filesystem::path truth;
  int page_port = 8380;  // -1: no page
};

RequestMaker MakeRequests(const StationConfig& config, SimHost& host) {
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
    request.framing = FramingCheck{.specimen = host.specimen_bounds(), .margin_px = 4};
    request.prompt = host.prompt();
    return request;
  };
}

Result<std::unique_ptr<Page>> StartPage(const DaemonOptions& options, CaptureService& service) {
  if (options.page_port < 0) return std::unique_ptr<Page>();
  SCAN_TRY(auto page, Page::Start(options.page_port,
                                  {.status = [&service] { return service.ReadStatus(); },
                                   .stop = [&service] { service.Stop(); },
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

  SCAN_TRY(const StationConfig config, LoadStationConfig(options.config));
  SCAN_TRY(const auto host, SimHost::Start(config, options.truth));
  CaptureService service(host->station());
  SCAN_TRY(const auto page, StartPage(options, service));
  SCAN_TRY(const auto server, RpcServer::Start(options.socket,
                                               DaemonFunctions(service, MakeRequests(config, *host),
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
