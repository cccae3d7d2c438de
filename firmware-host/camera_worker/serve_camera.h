// Serves a camera to its owner: the core of the camera worker programs.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "drivers/base/result.h"
#include "drivers/base/unique_fd.h"
#include "drivers/camera/camera.h"
#include "firmware-host/camera_worker/camera_messages.h"

namespace scan {

// What one kind of worker can do.
struct CameraWorkerRole {
  // Opens the camera that `options` (a document that owner and worker agree upon) names.
  std::function<Result<std::unique_ptr<Camera>>(const std::string& options)> open;
  std::function<Result<std::vector<CameraListing>>()> list;  // may be empty
};

// Serves one owner until it closes its end, then closes the camera. While a call runs, heartbeats
// tell the owner that the process lives; a cancel requests the call's stop token.
// Thread contract: blocks its thread; `role` is called on one further thread, which also opens,
// uses and closes the camera. `on_stuck` (may be empty) is called when the owner has gone and the
// call that runs has not ended 3 s after its token was requested; then it is waited for.
void ServeCamera(UniqueFd socket, const CameraWorkerRole& role,
                 const std::function<void()>& on_stuck = {});

// The main function of a worker program, started with its socket as descriptor 3. Without that
// descriptor it says what it is for and lists the cameras. The result is the exit code.
int CameraWorkerMain(const CameraWorkerRole& role, const char* program);

}  // namespace scan
