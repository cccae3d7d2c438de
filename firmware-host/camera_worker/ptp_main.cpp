// scanstation-camera-ptp: one tethered camera of libgphoto2, in a process of its own. Run once,
// with get | set | info OPTIONS [WORD...], it answers about a camera's settings and state instead.
#include <fmt/format.h>

#include <span>
#include <string_view>

#include "drivers/base/clock.h"
#include "drivers/camera/ptp/gphoto_system.h"
#include "drivers/camera/ptp/gpio_shutter.h"
#include "drivers/camera/ptp/ptp_device.h"
#include "drivers/io/gpio/gpiod_lines.h"
#include "firmware-host/camera_worker/ptp_options.h"
#include "firmware-host/camera_worker/serve_camera.h"
#include "firmware-host/camera_worker/worker_tool.h"

namespace scan {
namespace {

using Json = nlohmann::json;

Result<std::shared_ptr<PhotoSystem>> Library() {
  auto system = MakeGphotoSystem();
  if (!system) return tl::unexpected(PtpError(system.error(), "libgphoto2"));
  return std::shared_ptr<PhotoSystem>(std::move(*system));
}

Result<std::vector<PhotoDevice>> Devices(PhotoSystem& system) {
  auto devices = system.List();
  if (!devices) return tl::unexpected(PtpError(devices.error(), "USB"));
  return std::move(*devices);
}

Result<std::unique_ptr<Camera>> OpenCameraOf(const std::string& text) {
  SCAN_TRY(PtpCameraOptions options, PtpOptionsFrom(text));
  SCAN_TRY(auto system, Library());
  SCAN_TRY(auto lines, OpenGpioShutter(options.config, OpenGpiodLines));
  SCAN_TRY(std::unique_ptr<Camera> camera,
           PtpCamera::Open(std::move(options), std::move(system), std::move(lines),
                           std::make_shared<SystemClock>()));
  return camera;
}

Result<std::vector<CameraListing>> ListCameras() {
  SCAN_TRY(const auto system, Library());
  SCAN_TRY(const auto devices, Devices(*system));
  std::vector<CameraListing> cameras;
  for (const PhotoDevice& device : devices) {
    CameraListing listing{device.port, device.model, {"USB " + device.usb_id}};
    if (!device.serial.empty()) listing.details.push_back("serial " + device.serial);
    for (const std::string& program : system->Competitors(device))
      listing.details.push_back("may be taken by " + program);
    cameras.push_back(std::move(listing));
  }
  return cameras;
}

struct OpenedDevice {
  PhotoDevice device;
  std::unique_ptr<PhotoCamera> camera;
  std::vector<std::string> competitors;
};

Result<OpenedDevice> OpenSelectedDevice(const std::string& text) {
  SCAN_TRY(const PtpCameraOptions options, PtpOptionsFrom(text));
  SCAN_TRY(const auto system, Library());
  SCAN_TRY(const auto devices, Devices(*system));
  OpenedDevice opened;
  SCAN_TRY(opened.device, FindPhotoDevice(devices, options.config));
  SCAN_TRY(opened.camera, OpenPhotoDevice(*system, opened.device));
  opened.competitors = system->Competitors(opened.device);
  return opened;
}

Result<Json> Describe(PhotoCamera& camera, const std::string& name, const std::string& where) {
  const auto setting = camera.Get(name);
  if (!setting) return tl::unexpected(PtpError(setting.error(), where + ", " + name));
  return Json{{"name", name},
              {"label", setting->label},
              {"value", setting->value},
              {"choices", setting->choices},
              {"read_only", setting->read_only}};
}

Result<Json> GetSettings(const std::string& options, std::span<const std::string> names) {
  SCAN_TRY(const OpenedDevice opened, OpenSelectedDevice(options));
  const std::string where = Describe(opened.device);
  Json answer{{"camera", opened.device.model}, {"settings", Json::array()}};
  if (!names.empty()) {
    for (const std::string& name : names) {
      SCAN_TRY(Json setting, Describe(*opened.camera, name, where));
      answer["settings"].push_back(std::move(setting));
    }
    return answer;
  }
  const auto all = opened.camera->SettingNames();
  if (!all) return tl::unexpected(PtpError(all.error(), where));
  for (const std::string& name : *all) {  // some that are listed cannot be read
    if (auto setting = Describe(*opened.camera, name, where))
      answer["settings"].push_back(std::move(*setting));
  }
  return answer;
}

Result<Json> SetSettings(const std::string& options, std::span<const std::string> assignments) {
  SCAN_TRY(const OpenedDevice opened, OpenSelectedDevice(options));
  const std::string where = Describe(opened.device);
  Json answer{{"camera", opened.device.model}, {"settings", Json::array()}};
  for (const std::string& assignment : assignments) {
    const std::size_t equals = assignment.find('=');
    if (equals == std::string::npos || equals == 0)
      return BadInput(fmt::format("'{}' sets nothing", assignment), "device ptp set",
                      "write NAME=VALUE");
    const std::string name = assignment.substr(0, equals);
    const auto set = opened.camera->Set(name, assignment.substr(equals + 1));
    if (!set) return tl::unexpected(PtpError(set.error(), where));
    (void)opened.camera->WaitEvent(200);  // some take it over only then
    SCAN_TRY(Json setting, Describe(*opened.camera, name, where));
    answer["settings"].push_back(std::move(setting));
  }
  return answer;
}

Result<Json> ReadInfo(const std::string& options) {
  SCAN_TRY(const OpenedDevice opened, OpenSelectedDevice(options));
  SCAN_TRY(const PtpReadiness ready, ReadReadiness(*opened.camera, Describe(opened.device)));
  const PhotoAbilities abilities = opened.camera->Abilities();
  Json answer{{"camera", opened.device.model},    {"port", opened.device.port},
              {"serial", opened.device.serial},   {"usb_id", opened.device.usb_id},
              {"capture", abilities.capture},     {"trigger", abilities.trigger},
              {"settings", abilities.settings},   {"deletes", abilities.deletes},
              {"competitors", opened.competitors}};
  if (ready.battery_percent >= 0) answer["battery_percent"] = ready.battery_percent;
  if (ready.shots_left >= 0) answer["shots_left"] = ready.shots_left;
  return answer;
}

int Main(std::span<char*> argv) {
  const std::vector<std::string> words(argv.begin() + (argv.empty() ? 0 : 1), argv.end());
  if (words.size() >= 2) {
    const std::span<const std::string> rest = std::span(words).subspan(2);
    if (words[0] == "get") return PrintToolAnswer(GetSettings(words[1], rest));
    if (words[0] == "set") return PrintToolAnswer(SetSettings(words[1], rest));
    if (words[0] == "info") return PrintToolAnswer(ReadInfo(words[1]));
  }
  return CameraWorkerMain({OpenCameraOf, ListCameras}, kPtpWorker);
}

}  // namespace
}  // namespace scan

int main(int argc, char** argv) { return scan::Main({argv, static_cast<std::size_t>(argc)}); }
