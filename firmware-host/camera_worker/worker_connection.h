// One life of a worker and the calls made to it.
#pragma once

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>

#include "drivers/base/result.h"
#include "firmware-host/camera_worker/worker_camera.h"
#include "firmware-host/camera_worker/worker_link.h"

namespace scan {

// Thread contract: one thread at a time.
class WorkerConnection {
 public:
  // Errors: those of the launcher.
  static Result<std::unique_ptr<WorkerConnection>> Start(const CameraWorkerLauncher& launch,
                                                         const WorkerLimits& limits);

  // Errors: those of the function called. A worker that died, hung or answered nonsense has been
  // killed when the error (device) comes, and lost() is true from then on; so too a worker that
  // did not end a cancelled call in time (cancelled).
  Result<WorkerMessage> Call(const char* function, nlohmann::json params,
                             std::chrono::milliseconds limit, std::stop_token stop = {});

  // Kills it and gives the fault: "the camera worker `what`; it was killed by signal 9".
  Error Lose(const std::string& what);
  bool lost() const { return lost_; }

 private:
  WorkerConnection(std::unique_ptr<CameraWorker> worker, const WorkerLimits& limits);
  Result<WorkerMessage> Await(std::int64_t id, const char* function,
                              std::chrono::milliseconds limit, std::stop_token stop);

  std::unique_ptr<CameraWorker> worker_;
  WorkerLink link_;  // closed before the worker is ended
  WorkerLimits limits_;
  std::int64_t next_id_ = 1;
  bool lost_ = false;
  bool heard_ = false;  // anything from it so far
};

}  // namespace scan
