// A camera of libcamera, in a worker of its own.
#pragma once

#include <memory>
#include <vector>

#include "drivers/base/result.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/libcamera/libcamera_camera.h"
#include "firmware-host/camera_worker/worker_camera.h"

namespace scan {

// The worker's time limits follow those of the configuration; a camera that is not there at first
// is not waited for. A UVC camera, whose id names vendor and product, is reset before the last
// attempt at recovery where it is the only one. Errors: as WorkerCamera::Open.
Result<std::unique_ptr<Camera>> OpenLibcamera(const LibcameraOptions& options);

// Errors: as ListWorkerCameras.
Result<std::vector<CameraListing>> ListLibcameras();

}  // namespace scan
