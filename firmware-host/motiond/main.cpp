// scanstation-motiond: owns everything that moves, and the lamp; its clients talk to it over a Unix
// socket.
#include <fmt/format.h>
#include <signal.h>

#include <CLI/CLI.hpp>

#include "drivers/base/files.h"
#include "drivers/base/log.h"
#include "drivers/base/sha256.h"
#include "drivers/station/station_file.h"
#include "firmware-host/devices/open_lamp.h"
#include "firmware-host/devices/open_motion.h"
#include "firmware-host/protocol/motion_server.h"

namespace scan {
namespace {

Status Serve(const std::filesystem::path& config_path, const std::filesystem::path& socket) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);  // before any thread: all inherit it

  SCAN_TRY(const std::string text, ReadTextFile(config_path));
  SCAN_TRY(const StationConfig config, ParseStationConfig(text, config_path.string()));
  SCAN_TRY(const std::unique_ptr<Motion> motion, OpenMotion(config));
  SCAN_TRY(const std::unique_ptr<Lamp> lamp, OpenLamp(config));
  SCAN_TRY(const auto server,
           ListenForMotion(socket, *motion, {config.name, Sha256Hex(AsBytes(text))},
                           {lamp.get(), config.light.level, config.light.settle_ms}));
  Log(LogLevel::info, "ready", {{"socket", socket.string()}, {"station", config.name}});
  int signal = 0;
  sigwait(&signals, &signal);
  Log(LogLevel::info, "shutdown");
  return motion->Stop();
}

}  // namespace
}  // namespace scan

int main(int argc, char** argv) {
  std::filesystem::path config, socket = "/run/scanstation/motiond.sock";
  CLI::App app("scanstation-motiond: owns everything that moves");
  app.set_version_flag("--version", SCAN_VERSION);
  app.add_option("--config", config, "station file (configs/*.toml)")->required();
  app.add_option("--socket", socket, "Unix socket to listen on")->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  if (const auto served = scan::Serve(config, socket); !served) {
    fmt::print(stderr, "scanstation-motiond: {}\n", ToString(served.error()));
    return ExitCode(served.error());
  }
  return 0;
}
