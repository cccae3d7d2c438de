// Tethered cameras, each in a worker process of its own.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "drivers/base/result.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/ptp/ptp_camera.h"

namespace scan {

struct CameraListing;

// A worker that hangs is killed and started again; before the last time the camera's USB port is
// reset, if the configuration names its port or serial number. Errors: those of PtpCamera::Open.
Result<std::unique_ptr<Camera>> OpenPtp(const PtpCameraOptions& options);

// Those that libgphoto2 knows. Errors: device.
Result<std::vector<CameraListing>> ListPtpCameras();

// One answer about a camera; `verb` is get, set or info (see ptp_main.cpp). Errors: device,
// bad_input.
Result<nlohmann::json> AskPtp(const std::string& verb, const PtpConfig& which,
                              const std::vector<std::string>& words);

}  // namespace scan
