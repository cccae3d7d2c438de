// Cameras of libcamera tried by hand: scanstation device libcamera ACTION. The daemon must not be
// using them; the camera runs in its own process, as in a capture.
#include <fmt/format.h>

#include <memory>
#include <tuple>

#include "firmware-host/cli/commands.h"
#include "firmware-host/cli/still_files.h"
#include "firmware-host/devices/open_libcamera.h"

namespace scan {
namespace {

struct GrabOptions {
  LibcameraOptions camera;
  std::vector<std::string> controls;  // NAME=VALUE
  std::string size;
  StillOptions still;
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

Result<CommandOutput> GrabLibcameraStills(GrabOptions options, const CliContext& context) {
  LibcameraOptions& wanted = options.camera;
  if (!options.size.empty()) {
    SCAN_TRY(const auto size, ReadSize(options.size));
    std::tie(wanted.w, wanted.h) = size;
  }
  for (const std::string& assignment : options.controls) {
    SCAN_TRY(auto pair, SplitAssignment(assignment));
    wanted.config.controls.insert_or_assign(std::move(pair.first), std::move(pair.second));
  }
  SCAN_TRY(const auto camera, OpenLibcamera(wanted));
  return TakeStills(*camera, options.still, context.stop);
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
      [options](const CliContext& context) { return GrabLibcameraStills(*options, context); });
  LibcameraConfig& config = options->camera.config;
  AddStillOptions(grab, options->still);
  grab.add_option("--camera", config.camera, "its id or model, as listed; default the only one");
  grab.add_option("--role", config.role, "still, viewfinder or raw")
      ->check(CLI::IsMember({"still", "viewfinder", "raw"}))
      ->capture_default_str();
  grab.add_option("--format", config.pixel_format, "MJPEG YUYV ...; default the best of the size");
  grab.add_option("--size", options->size, "WIDTHxHEIGHT; default the largest");
  grab.add_option("--gain", options->still.gain, "default as it is")->check(Positive());
  grab.add_option("--set", options->controls, "NAME=VALUE of a control, more than once if needed");
}

}  // namespace scan
