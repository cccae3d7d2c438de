// Photographs taken elsewhere become a session.
#include <fmt/format.h>

#include <memory>

#include "acquisition/import/import.h"
#include "drivers/base/clock.h"
#include "firmware-host/cli/commands.h"

namespace scan {
namespace {

Result<CommandOutput> RunImport(ImportRequest& request, const CliContext& context) {
  request.now = SystemClock().Now();
  request.software_version = SCAN_VERSION;
  SCAN_TRY(const ImportReport report, ImportPhotographs(request, context.progress, context.stop));
  return CommandOutput{
      {{"session", report.session.string()},
       {"photographs", report.photographs},
       {"with_pose", report.with_pose},
       {"with_mask", report.with_mask}},
      fmt::format("{} photographs, {} with a pose, {} with a mask: {}\n", report.photographs,
                  report.with_pose, report.with_mask, report.session.string())};
}

}  // namespace

void AddImport(CommandSet& commands) {
  auto request = std::make_shared<ImportRequest>();
  CLI::App& command =
      commands.Add("import", "Make a session of photographs taken elsewhere",
                   [request](const CliContext& context) { return RunImport(*request, context); });
  command.add_option("--photos", request->photos, "folder of photographs");
  command.add_option("--masks", request->masks, "folder of masks, same base names");
  command.add_option("--ignore", request->ignore, "folder of ignore pictures, same base names");
  command.add_option("--transforms", request->transforms, "transforms.json");
  command.add_option("--colmap", request->colmap, "folder of COLMAP text files");
  command
      .add_option("--sensor-width-mm", request->sensor_width_mm,
                  "turns an EXIF focal length into pixels")
      ->check(Positive());
  command.add_option("--approx-distance-mm", request->approx_distance_mm, "camera to specimen")
      ->check(Positive());
  command.add_option("--out", request->out, "session folder to write")->required();
  command.add_flag("--force", request->force, "replace an existing session");
}

}  // namespace scan
