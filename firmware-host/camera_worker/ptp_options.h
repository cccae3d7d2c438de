// What the owner tells a worker of libgphoto2.
#pragma once

#include <string>

#include "drivers/base/result.h"
#include "drivers/camera/ptp/ptp_camera.h"

namespace scan {

constexpr char kPtpWorker[] = "scanstation-camera-ptp";  // the program

std::string ToWorkerOptions(const PtpCameraOptions& options);
// Errors: bad_input, for what ToWorkerOptions did not write.
Result<PtpCameraOptions> PtpOptionsFrom(const std::string& text);

}  // namespace scan
