// Cameras of libcamera tried by hand: scanstation device libcamera ACTION. The daemon must not be
// using them; the camera runs in its own process, as in a capture.
#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <memory>

#include "drivers/base/files.h"
#include "firmware-host/cli/commands.h"
#include "firmware-host/cli/still_files.h"
#include "firmware-host/devices/open_libcamera.h"

namespace scan {
namespace {

struct GrabOptions {
  LibcameraOptions camera;
  std::vector<std::string> controls;  // NAME=VALUE
  std::string size;
  double exposure_us = 0, gain = 0;
  std::filesystem::path out;
  int count = 1;
  bool force = false;
};

Result<CommandOutput> ListLibcameraCameras() {
  SCAN_TRY(const auto cameras, ListLibcameras());
  CommandOutput output{{{"cameras", Json::array()}}, ""};
  for (const CameraListing& camera : cameras) {
    output.json["cameras"].push_back(
        {{"id", camera.id}, {"model", camera.model}, {"details", camera.details}});
    output.text += fmt::format("{}\n  id  {}\n", camera.model, camera.id);
    for (const std::string& detail : camera.details) output.text += fmt::format("  {}\n", detail);
  }
  if (output.text.empty()) output.text = "libcamera finds no camera\n";
  return output;
}

Status ReadSize(const std::string& text, LibcameraOptions& camera) {
  if (text.empty()) return {};
  const char* end = text.data() + text.size();
  const auto w = std::from_chars(text.data(), end, camera.w);
  const bool has_x = w.ec == std::errc() && w.ptr != end && *w.ptr == 'x';
  const auto h = has_x ? std::from_chars(w.ptr + 1, end, camera.h) : w;
  if (has_x && h.ec == std::errc() && h.ptr == end && camera.w > 0 && camera.h > 0) return {};
  return BadInput(fmt::format("'{}' is no size", text), "--size", "write WIDTHxHEIGHT, in pixels");
}

Status ReadControls(const GrabOptions& options, LibcameraConfig& config) {
  for (const std::string& assignment : options.controls) {
    const std::size_t equals = assignment.find('=');
    if (equals == std::string::npos || equals == 0)
      return BadInput(fmt::format("'{}' sets nothing", assignment), "--set", "write NAME=VALUE");
    config.controls[assignment.substr(0, equals)] = assignment.substr(equals + 1);
  }
  return {};
}

Json StillJson(const Frame& frame, const std::filesystem::path& path) {
  Json still = {{"path", path.string()},
                {"sensor_sequence", frame.sensor_sequence},
                {"exposure_not_before_ns", frame.exposure.not_before_ns},
                {"exposure_not_after_ns", frame.exposure.not_after_ns},
                {"sensor_timestamp", frame.exposure.source == ExposureSource::sensor}};
  if (frame.applied.exposure_us) still["exposure_us"] = *frame.applied.exposure_us;
  if (frame.applied.gain) still["gain"] = *frame.applied.gain;
  return still;
}

Result<CommandOutput> GrabStills(GrabOptions options, const CliContext& context) {
  SCAN_CHECK(ReadSize(options.size, options.camera));
  SCAN_CHECK(ReadControls(options, options.camera.config));
  SCAN_TRY(const auto camera, OpenLibcamera(options.camera));
  CameraSettings settings;
  if (options.exposure_us > 0) settings.exposure_us = options.exposure_us;
  if (options.gain > 0) settings.gain = options.gain;
  SCAN_CHECK(camera->Configure(settings));
  CommandOutput output{{{"camera", camera->Info().model}, {"stills", Json::array()}}, ""};
  const auto told = [](const std::optional<double>& value, const char* unit) {
    return value ? fmt::format("{:g}{}", *value, unit) : std::string("not reported");
  };
  for (int i = 1; i <= options.count; ++i) {
    SCAN_TRY(const Frame frame, camera->Grab(context.stop));
    const EncodedFile& file = frame.files.front();
    const auto path = NumberedPath(options.out, file.extension, i, options.count);
    SCAN_CHECK(PrepareOutputFile(path, options.force));
    SCAN_CHECK(WriteFileDurably(path, file.bytes));
    output.json["stills"].push_back(StillJson(frame, path));
    output.text += fmt::format(
        "{}: {} x {}, exposure {}, gain {}\n", path.string(), camera->Info().w, camera->Info().h,
        told(frame.applied.exposure_us, " us"), told(frame.applied.gain, ""));
  }
  return output;
}

}  // namespace

void AddLibcameraDevices(CommandSet& commands, CLI::App& device) {
  CLI::App& libcamera =
      commands.AddGroup(&device, "libcamera", "Cameras of libcamera; no daemon may be using them");
  commands.AddTo(libcamera, "list", "Every camera with its streams, sizes and controls",
                 [](const CliContext&) { return ListLibcameraCameras(); });
  auto options = std::make_shared<GrabOptions>();
  CLI::App& grab = commands.AddTo(
      libcamera, "grab", "Take stills with automatic exposure and gain off",
      [options](const CliContext& context) { return GrabStills(*options, context); });
  LibcameraConfig& config = options->camera.config;
  grab.add_option("--out", options->out, "picture file; jpg or png is the camera's choice")
      ->required();
  grab.add_option("--camera", config.camera, "its id or model, as listed; default the only one");
  grab.add_option("--role", config.role, "still, viewfinder or raw")
      ->check(CLI::IsMember({"still", "viewfinder", "raw"}))
      ->capture_default_str();
  grab.add_option("--format", config.pixel_format, "MJPEG YUYV ...; default the best of the size");
  grab.add_option("--size", options->size, "WIDTHxHEIGHT; default the largest");
  grab.add_option("--exposure-us", options->exposure_us, "exposure time; default as it is")
      ->check(Positive());
  grab.add_option("--gain", options->gain, "default as it is")->check(Positive());
  grab.add_option("--set", options->controls, "NAME=VALUE of a control, more than once if needed");
  grab.add_option("--count", options->count, "so many stills")->check(CLI::Range(1, 10'000));
  grab.add_flag("--force", options->force, "overwrite files");
}

}  // namespace scan
