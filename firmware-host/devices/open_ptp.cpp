#include "firmware-host/devices/open_ptp.h"

#include "firmware-host/camera_worker/camera_messages.h"
#include "firmware-host/camera_worker/ptp_options.h"
#include "firmware-host/camera_worker/worker_camera.h"
#include "firmware-host/camera_worker/worker_tool.h"
#include "firmware-host/devices/worker_recovery.h"

namespace scan {
namespace {

constexpr std::chrono::milliseconds kToolLimit{60'000};    // a camera with hundreds of settings
constexpr std::chrono::milliseconds kLibraryTime{20'000};  // libgphoto2's own time-outs

std::filesystem::path Program() { return WorkerProgramPath(kPtpWorker); }

}  // namespace

Result<std::unique_ptr<Camera>> OpenPtp(const PtpCameraOptions& options) {
  const PtpConfig& config = options.config;
  WorkerCameraOptions worker;
  worker.id = options.id;
  worker.options = ToWorkerOptions(options);
  // The driver's own limits come first: they say more about what is wrong.
  const auto reopening = WholeMs(config.reconnect_ms) + kLibraryTime;
  worker.limits.open = kLibraryTime + reopening;
  worker.limits.configure = reopening + WholeMs(10 * config.settings_ms);
  worker.limits.grab =
      2 * WholeMs(2 * config.picture_ms + config.pair_ms + 10 * config.settings_ms) + reopening;
  if (!config.port.empty() || !config.serial.empty()) {
    const UsbSelector selector{0, {}, config.port, config.serial};
    worker.on_hang = [selector] { return ResetUsbCamera(selector); };
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
