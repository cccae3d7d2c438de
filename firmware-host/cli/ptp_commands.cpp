// Tethered cameras tried by hand: scanstation device ptp ACTION. The daemon must not be using them;
// the camera runs in its own process, as in a capture.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "drivers/base/files.h"
#include "drivers/station/station_file.h"
#include "firmware-host/camera_worker/camera_messages.h"
#include "firmware-host/cli/commands.h"
#include "firmware-host/devices/open_camera.h"
#include "firmware-host/devices/open_ptp.h"

namespace scan {
namespace {

struct PtpOptions {
  PtpCameraOptions camera;
  std::vector<std::string> words;  // names, or NAME=VALUE
  std::string size;
  double exposure_us = 0, gain = 0;
  std::filesystem::path config, out;
  std::string camera_id = "c0";
  int count = 1;
  bool force = false;
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
  int w = 0, h = 0, used = 0;
  if (std::sscanf(options.size.c_str(), "%dx%d%n", &w, &h, &used) != 2 || w <= 0 || h <= 0 ||
      static_cast<std::size_t>(used) != options.size.size())
    return BadInput(fmt::format("'{}' is no size", options.size), "--size",
                    "write WIDTHxHEIGHT of the camera's JPEG, in pixels, or name a --config");
  options.camera.w = w;
  options.camera.h = h;
  return OpenPtp(options.camera);
}

Result<CommandOutput> GrabStills(PtpOptions options, const CliContext& context) {
  SCAN_TRY(const auto camera, OpenForStills(options));
  CameraSettings settings;
  if (options.exposure_us > 0) settings.exposure_us = options.exposure_us;
  if (options.gain > 0) settings.gain = options.gain;
  SCAN_CHECK(camera->Configure(settings));
  CommandOutput output{{{"camera", camera->Info().model}, {"stills", Json::array()}}, ""};
  for (int i = 1; i <= options.count; ++i) {
    SCAN_TRY(const Frame frame, camera->Grab(context.stop));
    Json still = {{"paths", Json::array()},
                  {"exposure_not_before_ns", frame.exposure.not_before_ns},
                  {"exposure_not_after_ns", frame.exposure.not_after_ns},
                  {"hot_shoe", frame.exposure.source == ExposureSource::hot_shoe}};
    if (frame.applied.exposure_us) still["exposure_us"] = *frame.applied.exposure_us;
    if (frame.applied.gain) still["gain"] = *frame.applied.gain;
    for (const EncodedFile& file : frame.files) {
      std::filesystem::path path = options.out;
      if (options.count > 1)
        path.replace_filename(fmt::format("{}-{}", options.out.stem().string(), i));
      path.replace_extension(file.extension);
      SCAN_CHECK(PrepareOutputFile(path, options.force));
      SCAN_CHECK(WriteFileDurably(path, file.bytes));
      still["paths"].push_back(path.string());
      output.text +=
          fmt::format("{}: {} bytes, exposure {}\n", path.string(), file.bytes.size(),
                      frame.applied.exposure_us ? fmt::format("{:g} us", *frame.applied.exposure_us)
                                                : "not reported");
    }
    output.json["stills"].push_back(std::move(still));
  }
  return output;
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
      [options](const CliContext& context) { return GrabStills(*options, context); });
  AddSelector(grab, *options);
  PtpConfig& config = options->camera.config;
  grab.add_option("--out", options->out, "picture file; the extension is the camera's choice")
      ->required();
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
  grab.add_option("--exposure-us", options->exposure_us, "exposure time; default as it is")
      ->check(Positive());
  grab.add_option("--gain", options->gain, "ISO speed over 100; default as it is")
      ->check(Positive());
  grab.add_flag(
      "--any-focus", [&config](std::int64_t) { config.manual_focus = false; },
      "even when the lens is on automatic focus");
  grab.add_option("--count", options->count, "so many stills")->check(CLI::Range(1, 10'000));
  grab.add_flag("--force", options->force, "overwrite files");
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
