// Tethered cameras tried by hand: scanstation device ptp ACTION. The daemon must not be using them;
// the camera runs in its own process, as in a capture.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <memory>
#include <tuple>

#include "drivers/station/station_file.h"
#include "firmware-host/camera_worker/camera_listing.h"
#include "firmware-host/cli/commands.h"
#include "firmware-host/cli/still_files.h"
#include "firmware-host/devices/open_camera.h"
#include "firmware-host/devices/open_ptp.h"

namespace scan {
namespace {

struct PtpOptions {
  PtpCameraOptions camera;
  std::vector<std::string> words;  // names, or NAME=VALUE
  std::string size;
  StillOptions still;
  std::filesystem::path config;
  std::string camera_id = "c0";
};

Result<CommandOutput> ListStillCameras() {
  SCAN_TRY(const auto cameras, ListPtpCameras());
  CommandOutput output{{{"cameras", Json::array()}}, ""};
  for (const CameraListing& camera : cameras) {
    output.json["cameras"].push_back(
        {{"port", camera.id}, {"model", camera.model}, {"details", camera.details}});
    output.text += fmt::format("{}\n  port  {}\n", camera.model, camera.id);
    for (const std::string& detail : camera.details) output.text += fmt::format("  {}\n", detail);
  }
  if (output.text.empty()) output.text = "libgphoto2 finds no camera\n";
  return output;
}

Result<CommandOutput> ShowInfo(const PtpOptions& options) {
  SCAN_TRY(Json info, AskPtp("info", options.camera.config, {}));
  CommandOutput output{std::move(info), ""};
  for (const auto& [key, value] : output.json.items())
    output.text += fmt::format("{:<16} {}\n", key,
                               value.is_string() ? value.get<std::string>() : value.dump());
  return output;
}

Result<CommandOutput> ShowSettings(const char* verb, const PtpOptions& options) {
  SCAN_TRY(Json answer, AskPtp(verb, options.camera.config, options.words));
  CommandOutput output{std::move(answer), ""};
  for (const Json& setting : output.json.value("settings", Json::array())) {
    output.text += fmt::format("{} = {}{}\n", setting.value("name", ""), setting.value("value", ""),
                               setting.value("read_only", false) ? "  (read only)" : "");
    const auto choices = setting.value("choices", std::vector<std::string>());
    if (!choices.empty()) output.text += fmt::format("  {}\n", fmt::join(choices, "  "));
  }
  return output;
}

Result<std::unique_ptr<Camera>> OpenForStills(PtpOptions& options) {
  if (!options.config.empty()) {
    SCAN_TRY(const StationConfig station, LoadStationConfig(options.config));
    const CameraConfig* camera = FindCamera(station, options.camera_id);
    if (!camera || camera->driver != CameraDriver::ptp)
      return BadInput(fmt::format("it has no camera '{}' of the ptp driver", options.camera_id),
                      options.config.string(), "choose another --camera or --config");
    return OpenCamera(*camera, std::make_shared<SystemClock>());
  }
  if (options.size.empty())
    return BadInput("the size of the camera's JPEG is not known", "--size",
                    "write WIDTHxHEIGHT, in pixels, or name a --config");
  SCAN_TRY(const auto size, ReadSize(options.size));
  std::tie(options.camera.w, options.camera.h) = size;
  return OpenPtp(options.camera);
}

Result<CommandOutput> GrabTetheredStills(PtpOptions options, const CliContext& context) {
  SCAN_TRY(const auto camera, OpenForStills(options));
  return TakeStills(*camera, options.still, context.stop);
}

void AddSelector(CLI::App& command, PtpOptions& options) {
  command.add_option("--port", options.camera.config.port, "where it is plugged in, as listed");
  command.add_option("--serial", options.camera.config.serial, "its serial number, as listed");
  command.add_option("--model", options.camera.config.model, "its model, as listed");
}

void AddGrab(CommandSet& commands, CLI::App& ptp) {
  auto options = std::make_shared<PtpOptions>();
  options->camera.config.target = "";  // as the camera has it
  CLI::App& grab = commands.AddTo(
      ptp, "grab", "Take stills; RAW and JPEG of one exposure are two files",
      [options](const CliContext& context) { return GrabTetheredStills(*options, context); });
  AddSelector(grab, *options);
  PtpConfig& config = options->camera.config;
  AddStillOptions(grab, options->still);
  CLI::Option* file =
      grab.add_option("--config", options->config, "station file that says which camera and how");
  grab.add_option("--camera", options->camera_id, "id of the camera in that file")
      ->capture_default_str()
      ->needs(file);
  grab.add_option("--size", options->size, "WIDTHxHEIGHT of its JPEG");
  grab.add_option("--target", config.target, "where the camera keeps it; default as it is")
      ->check(CLI::IsMember({"ram", "card"}));
  grab.add_option("--quality", config.quality, "entry of imagequality or imageformat");
  grab.add_option("--f-number", config.f_number, "aperture; default as it is")->check(Positive());
  grab.add_option("--gain", options->still.gain, "ISO speed over 100; default as it is")
      ->check(Positive());
  grab.add_flag(
      "--any-focus", [&config](std::int64_t) { config.manual_focus = false; },
      "even when the lens is on automatic focus");
  for (const char* said_by_the_file :
       {"--port", "--serial", "--model", "--size", "--target", "--quality", "--f-number"})
    file->excludes(grab.get_option(said_by_the_file));
}

}  // namespace

void AddPtpDevices(CommandSet& commands, CLI::App& device) {
  CLI::App& ptp = commands.AddGroup(
      &device, "ptp", "Tethered still cameras (libgphoto2); no daemon may be using them");
  commands.AddTo(ptp, "list", "Every camera with its port",
                 [](const CliContext&) { return ListStillCameras(); });
  const auto add = [&](const char* name, const char* what, const char* words, auto run) {
    auto options = std::make_shared<PtpOptions>();
    CLI::App& command = commands.AddTo(ptp, name, what,
                                       [options, run](const CliContext&) { return run(*options); });
    AddSelector(command, *options);
    return words ? command.add_option("settings", options->words, words) : nullptr;
  };
  add("info", "What a camera can do; battery, card, programs that may take it", nullptr, ShowInfo);
  add("get", "Its settings: value and choices", "names; default all",
      [](const PtpOptions& options) { return ShowSettings("get", options); });
  add("set", "Set settings and say what the camera made of them", "NAME=VALUE",
      [](const PtpOptions& options) { return ShowSettings("set", options); })
      ->required();
  AddGrab(commands, ptp);
}

}  // namespace scan
