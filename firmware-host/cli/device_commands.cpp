// Devices tried by hand: scanstation device KIND ACTION. These open the device themselves; the
// daemon must not be using it.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <tuple>

#include "drivers/camera/v4l2/kernel_v4l2.h"
#include "drivers/camera/v4l2/v4l2_camera.h"
#include "drivers/station/station_file.h"
#include "firmware-host/cli/commands.h"
#include "firmware-host/cli/still_files.h"
#include "firmware-host/devices/open_camera.h"

namespace scan {
namespace {

struct CameraOptions {
  CameraSelector selector;
  std::string format, size;
  std::vector<std::string> controls;  // NAME=VALUE
  StillOptions still;
  std::filesystem::path config;
  std::string camera = "c0";
};

std::shared_ptr<V4l2System> Kernel() { return std::make_shared<KernelV4l2>(); }

Json FormatsJson(const std::vector<OfferedFormat>& formats) {
  Json list = Json::array();
  for (const OfferedFormat& format : formats) {
    Json sizes = Json::array();
    for (const FrameSize& size : format.sizes) {
      Json intervals = Json::array();
      for (const std::int64_t ns : size.intervals_ns)
        intervals.push_back(1e-6 * static_cast<double>(ns));
      sizes.push_back({{"width_px", size.w}, {"height_px", size.h}, {"interval_ms", intervals}});
    }
    list.push_back({{"format", FourccText(format.fourcc)},
                    {"understood", FindPixelFormat(format.fourcc) != nullptr},
                    {"range_of_sizes", format.step_w > 0},
                    {"sizes", sizes}});
  }
  return list;
}

std::string FormatsText(const std::vector<OfferedFormat>& formats) {
  std::string text;
  for (const OfferedFormat& format : formats) {
    text += fmt::format("  {:<5}", FourccText(format.fourcc));
    for (const FrameSize& size : format.sizes) text += fmt::format(" {}x{}", size.w, size.h);
    if (format.step_w > 0) text += " and between";
    text += FindPixelFormat(format.fourcc) ? "\n" : "  (not understood)\n";
  }
  return text;
}

Result<CommandOutput> ListKernelCameras() {
  const auto system = Kernel();
  CommandOutput output{{{"cameras", Json::array()}}, ""};
  for (const VideoNode& node : ListCaptureNodes(system)) {
    SCAN_TRY(const auto device, V4l2Device::Open(system, node));
    SCAN_TRY(const auto formats, ListFormats(*device, true));
    output.json["cameras"].push_back({{"name", node.name},
                                      {"port", node.port},
                                      {"usb_id", node.usb_id},
                                      {"serial", node.serial},
                                      {"driver", device->driver()},
                                      {"path", node.path},
                                      {"formats", FormatsJson(formats)}});
    output.text += fmt::format(
        "{}\n  port  {}\n  node  {} (driver {}{}{})\n{}", node.name, node.port, node.path,
        device->driver(), node.usb_id.empty() ? "" : ", USB ", node.usb_id, FormatsText(formats));
  }
  if (output.text.empty()) output.text = "no camera is connected\n";
  return output;
}

Result<CommandOutput> ListCameraControls(const CameraOptions& options) {
  SCAN_TRY(const auto device, OpenSelected(Kernel(), options.selector));
  SCAN_TRY(const auto controls, ListControls(*device));
  CommandOutput output{{{"camera", device->node().name}, {"controls", Json::array()}}, ""};
  for (const V4l2Control& control : controls) {
    Json menu = Json::array();
    std::string choices;
    for (const ControlMenuEntry& entry : control.menu) {
      menu.push_back({{"value", entry.value}, {"name", entry.name}});
      choices += fmt::format("  {} ({})", entry.value, entry.name);
    }
    Json json = {{"name", control.name},
                 {"type", std::string(NameOf(control.type))},
                 {"min", control.min},
                 {"max", control.max},
                 {"step", control.step},
                 {"default", control.default_value},
                 {"read_only", control.read_only},
                 {"inactive", control.inactive},
                 {"menu", menu}};
    std::string value = "?";
    if (const auto read = ReadControl(*device, control)) {
      json["value"] = *read;
      value = ControlValueText(control, *read);
    }
    output.json["controls"].push_back(std::move(json));
    output.text +=
        fmt::format("{:<34} {:<12} {} to {} step {}, now {}{}{}\n", control.name,
                    NameOf(control.type), control.min, control.max, control.step, value,
                    control.inactive ? " (inactive)" : "", control.read_only ? " (read only)" : "");
    if (!choices.empty()) output.text += fmt::format("  {}\n", choices);
  }
  return output;
}

Result<CommandOutput> SetCameraControls(const CameraOptions& options) {
  SCAN_TRY(const auto device, OpenSelected(Kernel(), options.selector));
  CommandOutput output{{{"camera", device->node().name}, {"applied", Json::object()}}, ""};
  for (const std::string& assignment : options.controls) {
    SCAN_TRY(const auto pair, SplitAssignment(assignment));
    SCAN_TRY(const auto controls, ListControls(*device));  // anew: one may wake another
    const V4l2Control* control = FindControl(controls, pair.first);
    if (!control)
      return BadInput(fmt::format("the camera has no control '{}'", pair.first), device->Where(),
                      "'scanstation device camera controls' lists them");
    SCAN_TRY(const std::int64_t value, ParseControlValue(*control, pair.second));
    SCAN_TRY(const std::int64_t made, WriteControl(*device, *control, value));
    output.json["applied"][control->name] = made;
    output.text += fmt::format("{} = {}\n", control->name, ControlValueText(*control, made));
  }
  return output;
}

Result<std::unique_ptr<Camera>> OpenForStills(const CameraOptions& options) {
  const auto clock = std::make_shared<SystemClock>();
  if (!options.config.empty()) {
    SCAN_TRY(const StationConfig station, LoadStationConfig(options.config));
    const CameraConfig* camera = FindCamera(station, options.camera);
    if (!camera || camera->driver == CameraDriver::sim)
      return BadInput(fmt::format("it has no real camera '{}'", options.camera),
                      options.config.string(), "choose another --camera or --config");
    return OpenCamera(*camera, clock);
  }
  V4l2CameraOptions camera;
  camera.config.port = options.selector.port;
  camera.config.name = options.selector.name;
  camera.config.pixel_format = options.format;
  for (const std::string& assignment : options.controls) {
    SCAN_TRY(auto pair, SplitAssignment(assignment));
    camera.config.controls.insert(std::move(pair));
  }
  if (!options.size.empty()) {
    SCAN_TRY(const auto size, ReadSize(options.size));
    std::tie(camera.w, camera.h) = size;
  }
  SCAN_TRY(std::unique_ptr<Camera> opened, V4l2Camera::Open(camera, Kernel(), clock));
  return opened;
}

Result<CommandOutput> GrabKernelStills(const CameraOptions& options, const CliContext& context) {
  SCAN_TRY(const auto camera, OpenForStills(options));
  return TakeStills(*camera, options.still, context.stop);
}

void AddSelector(CLI::App& command, const std::shared_ptr<CameraOptions>& options) {
  command.add_option("--port", options->selector.port, "where it is plugged in, as listed");
  command.add_option("--name", options->selector.name, "its name, as listed");
}

}  // namespace

void AddCameraDevices(CommandSet& commands, CLI::App& device) {
  CLI::App& camera = commands.AddGroup(&device, "camera",
                                       "Cameras of the kernel (V4L2); no daemon may be using them");
  commands.AddTo(camera, "list", "Every camera with its port, formats and sizes",
                 [](const CliContext&) { return ListKernelCameras(); });
  {
    auto options = std::make_shared<CameraOptions>();
    AddSelector(
        commands.AddTo(camera, "controls", "Every control: kind, range, choices, value",
                       [options](const CliContext&) { return ListCameraControls(*options); }),
        options);
  }
  {
    auto options = std::make_shared<CameraOptions>();
    CLI::App& set =
        commands.AddTo(camera, "set", "Set controls and say what the camera made of them",
                       [options](const CliContext&) { return SetCameraControls(*options); });
    AddSelector(set, options);
    set.add_option("controls", options->controls, "NAME=VALUE: a number, true, false, a menu entry")
        ->required();
  }
  auto options = std::make_shared<CameraOptions>();
  CLI::App& grab = commands.AddTo(
      camera, "grab", "Take stills with exposure, gain, white balance and focus locked",
      [options](const CliContext& context) { return GrabKernelStills(*options, context); });
  AddSelector(grab, options);
  AddStillOptions(grab, options->still);
  CLI::Option* config =
      grab.add_option("--config", options->config, "station file that says which camera and how");
  grab.add_option("--camera", options->camera, "id of the camera in that file")
      ->capture_default_str()
      ->needs(config);
  grab.add_option("--format", options->format, "MJPG YUYV NV12 ...; default the best of the size");
  grab.add_option("--size", options->size, "WIDTHxHEIGHT; default the largest");
  grab.add_option("--set", options->controls, "NAME=VALUE of a control, more than once if needed");
  for (const char* said_by_the_file : {"--port", "--name", "--format", "--size", "--set"})
    config->excludes(grab.get_option(said_by_the_file));
}

}  // namespace scan
