// Sessions without a station: replay, verify.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "acquisition/session/session_verify.h"
#include "acquisition/twins/compare_sessions.h"
#include "acquisition/twins/replay.h"
#include "firmware-host/cli/commands.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

struct SessionOptions {
  fs::path session, out;
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

}  // namespace scan
