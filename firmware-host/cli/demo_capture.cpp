#include "firmware-host/cli/demo_capture.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>

#include "drivers/base/files.h"
#include "firmware-host/cli/child_process.h"
#include "firmware-host/cli/daemon_client.h"
#include "reconstruction/specimens/specimen.h"
#include "reconstruction/specimens/synthetic_ct.h"
#include "reconstruction/volume/write_volume.h"

namespace scan {

namespace fs = std::filesystem;

DemoPaths DemoPathsIn(const fs::path& folder) {
  return {folder / "session",     folder / "ct.mha", folder / "model",
          folder / "truth.jsonl", folder / "log",    folder / "station.toml"};
}

Status CaptureDemo(const DemoPaths& paths, const std::string& specimen, const std::string& errors,
                   const CliContext& context) {
  // The default simulated station but for the specimen and its errors.
  SCAN_CHECK(
      WriteFileDurably(paths.config, fmt::format("name = \"demo\"\n\n[sim]\nspecimen = \"{}\"\n\n"
                                                 "[sim.errors]\nlevel = \"{}\"\n",
                                                 specimen, errors)));
  const fs::path socket =
      fs::temp_directory_path() / fmt::format("scanstation-demo-{}.sock", ::getpid());
  SCAN_TRY(const auto daemon,
           ChildProcess::Start(ProgramFolder() / "scanstationd",
                               {"--config", paths.config.string(), "--socket", socket.string(),
                                "--page-port", "0", "--truth", paths.truth.string()},
                               paths.log));
  auto client = ConnectDaemon(socket, std::chrono::seconds(60));
  if (!client) {
    const auto log = ReadTextFile(paths.log);
    return Failed("scanstationd did not start", log ? *log : paths.log.string(),
                  "see its log " + paths.log.string());
  }
  SCAN_CHECK(CaptureAndFollow(**client, {{"out", paths.session.string()}}, context.progress,
                              context.stop));
  return {};
}

Status MakeDemoCt(const DemoPaths& paths, const std::string& specimen_name) {
  SCAN_TRY(const auto specimen, MakeSpecimen(specimen_name));
  return WriteVolume(paths.volume, SynthesiseCt(*specimen, CtOptions{}), {.compressed = false});
}

}  // namespace scan
