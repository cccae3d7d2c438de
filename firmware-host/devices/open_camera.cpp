#include "firmware-host/devices/open_camera.h"

#include <cassert>

#include "drivers/camera/v4l2/kernel_v4l2.h"
#include "drivers/camera/v4l2/v4l2_camera.h"
#include "firmware-host/camera_worker/libcamera_options.h"
#include "firmware-host/devices/open_libcamera.h"
#include "firmware-host/devices/open_ptp.h"

namespace scan {
namespace {

Result<std::unique_ptr<Camera>> OpenDriver(const CameraConfig& config,
                                           std::shared_ptr<Clock> clock) {
  switch (config.driver) {
    case CameraDriver::v4l2: {
      V4l2CameraOptions options{config.id, config.w, config.h, config.v4l2};
      return V4l2Camera::Open(options, std::make_shared<KernelV4l2>(), std::move(clock));
    }
    case CameraDriver::libcamera:
      return OpenLibcamera({config.id, config.w, config.h, config.libcamera});
    case CameraDriver::ptp:
      return OpenPtp({config.id, config.w, config.h, config.ptp});
    case CameraDriver::sim:
      break;
  }
  assert(false);
  return BadInput("a simulated camera is no device", "camera.driver", "name a real driver");
}

}  // namespace

Result<std::unique_ptr<Camera>> OpenCamera(const CameraConfig& config,
                                           std::shared_ptr<Clock> clock) {
  SCAN_TRY(std::unique_ptr<Camera> camera, OpenDriver(config, std::move(clock)));
  SCAN_CHECK(camera->Configure({.exposure_us = config.exposure_us, .gain = config.gain}));
  return camera;
}

}  // namespace scan
