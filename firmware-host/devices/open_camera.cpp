#include "firmware-host/devices/open_camera.h"

#include <cassert>

#include "drivers/camera/v4l2/kernel_v4l2.h"
#include "drivers/camera/v4l2/v4l2_camera.h"

namespace scan {

Result<std::unique_ptr<Camera>> OpenCamera(const CameraConfig& config,
                                           std::shared_ptr<Clock> clock) {
  assert(config.driver == CameraDriver::v4l2);
  V4l2CameraOptions options{config.id, config.w, config.h, config.v4l2};
  SCAN_TRY(std::unique_ptr<Camera> camera,
           V4l2Camera::Open(options, std::make_shared<KernelV4l2>(), std::move(clock)));
  SCAN_CHECK(camera->Configure({.exposure_us = config.exposure_us, .gain = config.gain}));
  return camera;
}

}  // namespace scan
