// Clients of scanstationd: capture, resume, confirm, status, stop, pause, continue.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "firmware-host/cli/commands.h"
#include "firmware-host/cli/daemon_client.h"
#include "firmware-host/protocol/socket.h"

namespace scan {
namespace {

struct StationOptions {
  std::filesystem::path socket = DefaultSocket();
  std::filesystem::path session;
  bool no_plates = false;  // of capture and resume
  bool no = false;         // of confirm
};

Result<CommandOutput> RunCaptureCommand(const StationOptions& options, bool resume,
                                        const CliContext& context) {
  SCAN_TRY(const auto daemon, ConnectDaemon(options.socket));
  const std::string session = std::filesystem::absolute(options.session).string();
  SCAN_TRY(const Json status,
           CaptureAndFollow(*daemon,
                            {{"out", session}, {"resume", resume}, {"plates", !options.no_plates}},
                            context.progress, context.stop));
  return CommandOutput{status,
                       fmt::format("{} of {} views in {}\n", status.value("views_accepted", 0),
                                   status.value("view_count", 0), session)};
}

Result<CommandOutput> CallSimple(const StationOptions& options, const std::string& call) {
  SCAN_TRY(const auto daemon, ConnectDaemon(options.socket));
  SCAN_TRY(const Json answer, daemon->Call(call, Json::object(), std::chrono::milliseconds(10000)));
  return CommandOutput{answer, call == "status" ? "" : "done\n"};
}

Result<CommandOutput> ConfirmCommand(const StationOptions& options) {
  SCAN_TRY(const auto daemon, ConnectDaemon(options.socket));
  SCAN_TRY(const Json answer,
           daemon->Call("answer", {{"confirmed", !options.no}, {"note", "confirm"}},
                        std::chrono::milliseconds(10000)));
  return CommandOutput{answer, "done\n"};
}

void AddPlatesOption(CLI::App& command, StationOptions& options) {
  command.add_flag("--no-plates", options.no_plates,
                   "no background pictures: nobody is asked to take the specimen away");
}

std::string Question(const std::string& question) {
  if (question == "remove") return "take the specimen off the platter, then: scanstation confirm";
  if (question == "place") return "put the specimen back on the platter, then: scanstation confirm";
  return "nothing";
}

Result<CommandOutput> ReadStatusCommand(const StationOptions& options) {
  SCAN_TRY(CommandOutput output, CallSimple(options, "status"));
  const Json& s = output.json;
  const Json& motion = s["motion"];
  output.text = fmt::format(
      "state      {}\nviews      {} of {}, {} failed\nsession    {}\nturntable  {} {:.3f} deg\n"
      "lift       {} {:.3f} mm\nasks       {}\nmessage    {}\n",
      s.value("state", ""), s.value("views_accepted", 0), s.value("view_count", 0),
      s.value("views_failed", 0), s.value("session", ""), motion.value("turntable", ""),
      motion["position"]["turntable_deg"].value("estimated", 0.0), motion.value("lift", ""),
      motion["position"]["lift_mm"].value("estimated", 0.0), Question(s.value("question", "")),
      s.value("message", ""));
  return output;
}

std::shared_ptr<StationOptions> AddSocketOption(CLI::App& command,
                                                std::shared_ptr<StationOptions> options) {
  command.add_option("--socket", options->socket, "scanstationd's socket")->capture_default_str();
  return options;
}

}  // namespace

void AddCapture(CommandSet& commands) {
  auto options = std::make_shared<StationOptions>();
  CLI::App& command = commands.Add(
      "capture", "Capture a specimen on the station and follow it to its end",
      [options](const CliContext& context) { return RunCaptureCommand(*options, false, context); });
  AddSocketOption(command, options);
  command.add_option("--out", options->session, "session folder to write")->required();
  AddPlatesOption(command, *options);
}

void AddResume(CommandSet& commands) {
  auto options = std::make_shared<StationOptions>();
  CLI::App& command = commands.Add(
      "resume", "Go on with an interrupted session: home again, take the views it lacks",
      [options](const CliContext& context) { return RunCaptureCommand(*options, true, context); });
  AddSocketOption(command, options);
  command.add_option("session", options->session, "session folder")->required();
  AddPlatesOption(command, *options);
}

void AddStationControl(CommandSet& commands) {
  {
    auto options = std::make_shared<StationOptions>();
    CLI::App& command = commands.Add(
        "confirm", "Answer the station: the specimen is off the platter, or back on it",
        [options](const CliContext&) { return ConfirmCommand(*options); });
    AddSocketOption(command, options);
    command.add_flag("--no", options->no,
                     "it is not: go on without background pictures, or end the capture");
  }
  {
    auto options = std::make_shared<StationOptions>();
    AddSocketOption(
        commands.Add("status", "What the station is doing",
                     [options](const CliContext&) { return ReadStatusCommand(*options); }),
        options);
  }
  const auto add_simple = [&commands](const char* name, const char* description, const char* call) {
    auto options = std::make_shared<StationOptions>();
    AddSocketOption(
        commands.Add(name, description,
                     [options, call](const CliContext&) { return CallSimple(*options, call); }),
        options);
  };
  add_simple("stop", "Stop motion and end the capture; the session stays valid", "stop");
  add_simple("pause", "Pause the capture before its next step", "pause");
  add_simple("continue", "Go on with a paused capture", "resume");
}

}  // namespace scan
