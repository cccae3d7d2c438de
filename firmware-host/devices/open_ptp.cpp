#include "firmware-host/devices/open_ptp.h"

#include <cmath>

#include "drivers/usb/libusb_bus.h"
#include "firmware-host/camera_worker/camera_messages.h"
#include "firmware-host/camera_worker/ptp_options.h"
#include "firmware-host/camera_worker/worker_camera.h"
#include "firmware-host/camera_worker/worker_tool.h"

namespace scan {
namespace {

constexpr std::chrono::milliseconds kToolLimit{60'000};    // a camera with hundreds of settings
constexpr std::chrono::milliseconds kLibraryTime{20'000};  // libgphoto2's own time-outs

std::filesystem::path Program() { return WorkerProgramPath(kPtpWorker); }

std::chrono::milliseconds Ms(double ms) { return std::chrono::milliseconds(std::llround(ms)); }

Status ResetUsb(const UsbSelector& selector) {
  SCAN_TRY(const auto bus, MakeLibusbBus());
  SCAN_TRY(const auto devices, bus->List());
  SCAN_TRY(const UsbIdentity identity, FindUsb(devices, selector, "camera"));
  SCAN_TRY(const auto device, bus->Open(identity));
  return device->Reset();
}

}  // namespace

Result<std::unique_ptr<Camera>> OpenPtp(const PtpCameraOptions& options) {
  const PtpConfig& config = options.config;
  WorkerCameraOptions worker;
  worker.id = options.id;
  worker.options = ToWorkerOptions(options);
  // The driver's own limits come first: they say more about what is wrong.
  const auto reopening = Ms(config.reconnect_ms) + kLibraryTime;
  worker.limits.open = kLibraryTime + reopening;
  worker.limits.configure = reopening + Ms(10 * config.settings_ms);
  worker.limits.grab =
      2 * Ms(2 * config.picture_ms + config.pair_ms + 10 * config.settings_ms) + reopening;
  if (!config.port.empty() || !config.serial.empty()) {
    const UsbSelector selector{0, {}, config.port, config.serial};
    worker.on_hang = [selector] { return ResetUsb(selector); };
  }
  SCAN_TRY(std::unique_ptr<Camera> camera,
           WorkerCamera::Open(std::move(worker), WorkerProgram(Program())));
  return camera;
}

Result<std::vector<CameraListing>> ListPtpCameras() {
  return ListWorkerCameras(WorkerProgram(Program()));
}

Result<nlohmann::json> AskPtp(const std::string& verb, const PtpConfig& which,
                              const std::vector<std::string>& words) {
  PtpCameraOptions options;
  options.config = which;
  std::vector<std::string> arguments{verb, ToWorkerOptions(options)};
  arguments.insert(arguments.end(), words.begin(), words.end());
  return RunWorkerTool(Program(), arguments, kToolLimit);
}

}  // namespace scan
