// Sessions without a station: replay, verify, import.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "acquisition/session/import.h"
#include "acquisition/session/session_verify.h"
#include "acquisition/twins/compare_sessions.h"
#include "acquisition/twins/replay.h"
#include "drivers/base/clock.h"
#include "firmware-host/cli/commands.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

struct SessionOptions {
  fs::path session, out;
  ImportRequest import;
};

Result<CommandOutput> RunReplay(const SessionOptions& options) {
  SCAN_TRY(const auto runs, ReplaySession(options.session, options.out));
  SCAN_CHECK(CompareSessions(options.session, options.out));
  return CommandOutput{
      {{"session", options.out.string()}, {"runs", runs.size()}, {"identical", true}},
      fmt::format("{} run(s) replayed, the same byte for byte: {}\n", runs.size(),
                  options.out.string())};
}

Result<CommandOutput> RunVerify(const SessionOptions& options, const CliContext& context) {
  SCAN_TRY(const SessionReport report, VerifySession(options.session, context.progress));
  Json problems = Json::array();
  std::string text;
  for (const Error& problem : report.problems) {
    problems.push_back(ToString(problem));
    text += "problem  " + ToString(problem) + "\n";
  }
  for (const std::string& note : report.notes) text += "note     " + note + "\n";
  text += fmt::format("{} documents, {} files, {} of {} views complete\n", report.log_documents,
                      report.files_checked, report.views_complete.size(),
                      report.views_complete.size() + report.views_missing.size());
  if (!report.sound())
    return Failed(fmt::format("{} problem(s), the first: {}", report.problems.size(),
                              ToString(report.problems.front())),
                  options.session.string(), "restore the files named from a copy");
  return CommandOutput{{{"sound", true},
                        {"problems", problems},
                        {"notes", report.notes},
                        {"views_complete", report.views_complete},
                        {"views_missing", report.views_missing},
                        {"files_checked", report.files_checked}},
                       text + "sound\n"};
}

Result<CommandOutput> RunImport(SessionOptions& options, const CliContext& context) {
  options.import.now = SystemClock().Now();
  options.import.software_version = SCAN_VERSION;
  SCAN_TRY(const ImportReport report,
           ImportPhotographs(options.import, context.progress, context.stop));
  return CommandOutput{
      {{"session", report.session.string()},
       {"photographs", report.photographs},
       {"with_pose", report.with_pose},
       {"with_mask", report.with_mask}},
      fmt::format("{} photographs, {} with a pose, {} with a mask: {}\n", report.photographs,
                  report.with_pose, report.with_mask, report.session.string())};
}

}  // namespace

void AddReplay(CommandSet& commands) {
  auto options = std::make_shared<SessionOptions>();
  CLI::App& command =
      commands.Add("replay", "Run a recorded session's capture again without devices and compare",
                   [options](const CliContext&) { return RunReplay(*options); });
  command.add_option("session", options->session, "recorded session folder")->required();
  command.add_option("--out", options->out, "session folder to write")->required();
}

void AddVerify(CommandSet& commands) {
  auto options = std::make_shared<SessionOptions>();
  CLI::App& command =
      commands.Add("verify", "Check that a session is whole and unaltered",
                   [options](const CliContext& context) { return RunVerify(*options, context); });
  command.add_option("session", options->session, "session folder")->required();
}

void AddImport(CommandSet& commands) {
  auto options = std::make_shared<SessionOptions>();
  ImportRequest& request = options->import;
  CLI::App& command =
      commands.Add("import", "Make a session of photographs taken elsewhere",
                   [options](const CliContext& context) { return RunImport(*options, context); });
  command.add_option("--photos", request.photos, "folder of photographs");
  command.add_option("--masks", request.masks, "folder of masks, same base names");
  command.add_option("--ignore", request.ignore, "folder of ignore pictures, same base names");
  command.add_option("--transforms", request.transforms, "transforms.json");
  command.add_option("--colmap", request.colmap, "folder of COLMAP text files");
  command
      .add_option("--sensor-width-mm", request.sensor_width_mm,
                  "turns an EXIF focal length into pixels")
      ->check(Positive());
  command.add_option("--approx-distance-mm", request.approx_distance_mm, "camera to specimen")
      ->check(Positive());
  command.add_option("--out", request.out, "session folder to write")->required();
  command.add_flag("--force", request.force, "replace an existing session");
}

}  // namespace scan
