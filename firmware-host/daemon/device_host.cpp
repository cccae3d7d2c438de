#include "firmware-host/daemon/device_host.h"

#include "firmware-host/devices/open_camera.h"
#include "firmware-host/protocol/motion_client.h"
#include "firmware-host/protocol/socket.h"

namespace scan {
namespace {

constexpr std::chrono::milliseconds kMotionPatience{10000};  // for a motiond that is just starting

Status CheckAllReal(const StationConfig& config) {
  if (config.motion_driver == MotionDriver::sim)
    return BadInput("the cameras are real ones, and the axes are simulated", "motion.driver",
                    "name the driver that moves them, or simulate the cameras too");
  for (const CameraConfig& camera : config.cameras) {
    if (camera.driver == CameraDriver::sim)
      return BadInput("camera " + camera.id + " is simulated, and the axes are real ones",
                      "camera.driver", "name the driver of a real camera");
  }
  return {};
}

// Two programs that read different files would agree on no position.
Status CheckSameConfig(RpcClient& motiond, const std::string& config_sha256) {
  SCAN_TRY(const Json described, motiond.Call("describe", Json::object(), kMotionPatience));
  if (described.value("config_sha256", "") == config_sha256) return {};
  return BadInput("scanstation-motiond runs with another station file (station '" +
                      described.value("station", "") + "')",
                  "--config", "start both with the same file");
}

}  // namespace

Result<std::unique_ptr<DeviceHost>> DeviceHost::Start(const StationConfig& config,
                                                      const std::string& config_sha256,
                                                      const std::filesystem::path& motion_socket,
                                                      OperatorPrompt& operator_prompt) {
  SCAN_CHECK(CheckAllReal(config));
  {
    SCAN_TRY(UniqueFd fd, ConnectUnix(motion_socket, kMotionPatience));
    RpcClient motiond(std::move(fd));
    SCAN_CHECK(CheckSameConfig(motiond, config_sha256));
  }
  std::unique_ptr<DeviceHost> host(new DeviceHost(operator_prompt));
  SCAN_TRY(UniqueFd fd, ConnectUnix(motion_socket, kMotionPatience));
  host->station_.clock = std::make_shared<SystemClock>();
  auto motion = std::make_unique<MotionClient>(std::move(fd));
  if (config.light.driver != LightDriver::none) {
    host->station_.light = motion->MakeLight(host->station_.clock);
  }
  host->station_.motion = std::move(motion);
  for (const CameraConfig& camera : config.cameras) {
    SCAN_TRY(host->station_.cameras[camera.id], OpenCamera(camera, host->station_.clock));
  }
  return host;
}

SpecimenPrompt DeviceHost::prompt() {
  return [this](SpecimenAction action, std::stop_token stop) {
    return operator_prompt_.Ask(action, stop);
  };
}

}  // namespace scan
