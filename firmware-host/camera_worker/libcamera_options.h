// What the owner tells a worker of libcamera.
#pragma once

#include <string>

#include "drivers/base/result.h"
#include "drivers/camera/libcamera/libcamera_camera.h"

namespace scan {

constexpr char kLibcameraWorker[] = "scanstation-camera-libcamera";  // the program

std::string ToWorkerOptions(const LibcameraOptions& options);
// Errors: bad_input, for what ToWorkerOptions did not write.
Result<LibcameraOptions> LibcameraOptionsFrom(const std::string& text);

}  // namespace scan
