// A camera that lives in a worker program of its own.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "drivers/camera/camera.h"
#include "firmware-host/camera_worker/camera_listing.h"
#include "firmware-host/camera_worker/worker_process.h"

namespace scan {

class WorkerConnection;

// After these times without an answer a worker hangs, and is killed.
struct WorkerLimits {
  std::chrono::milliseconds open{20000};
  std::chrono::milliseconds configure{5000};
  std::chrono::milliseconds grab{15000};  // without the exposure asked for, which is added
  std::chrono::milliseconds silence{
      3000};  // without a heartbeat, while a call runs, after its first
  std::chrono::milliseconds cancel{2000};  // for a call that was cancelled to end
  int restarts = 2;                        // in a row, within one call
  std::uint64_t max_picture_bytes = 256U << 20;
};

struct WorkerCameraOptions {
  std::string id;       // of the camera in the session
  std::string options;  // for CameraWorkerRole::open
  // The same until the camera has been opened once: one that never was there is not waited for.
  // Empty: as `options`.
  std::string first_options;
  WorkerLimits limits;
  // The last step of recovery: called before the last restart of a worker that hung or whose
  // camera does not work, to reset the device (drivers/usb). What it gives is logged. May be empty.
  std::function<Status()> on_hang;
};

// A worker that dies, hangs (kills included: SIGSTOP, a kernel call that does not return), answers
// nonsense, or whose camera reports a device fault is killed and started anew; the settings asked
// for last are set again, and the call is made again. What a worker sends is trusted in nothing:
// types, ranges, lengths and descriptors are checked. Each restart is logged.
// Thread contract: as Camera. A frame is copied twice (into a memory file and out of it).
class WorkerCamera final : public Camera {
 public:
  // Starts the worker and opens the camera. Errors: those of the worker's `open`; device, when it
  // died or hung `restarts` times in a row.
  static Result<std::unique_ptr<WorkerCamera>> Open(WorkerCameraOptions options,
                                                    CameraWorkerLauncher launch);
  ~WorkerCamera() override;

  const CameraInfo& Info() const override { return info_; }
  Result<AppliedSettings> Configure(const CameraSettings& settings) override;
  Result<Frame> Grab(std::stop_token stop) override;

  // Of the whole life of this object, for reports.
  int restarts() const { return restarts_; }

 private:
  WorkerCamera(WorkerCameraOptions options, CameraWorkerLauncher launch);
  template <class T, class Use>
  Result<T> WithWorker(const char* doing, std::stop_token stop, Use use);
  Status EnsureConnected(std::stop_token stop);
  void Recover(const Error& fault, const char* doing, int restart);
  Result<AppliedSettings> SendSettings(const CameraSettings& settings);

  WorkerCameraOptions options_;
  CameraWorkerLauncher launch_;
  CameraInfo info_;
  CameraSettings asked_;  // everything asked for so far
  std::unique_ptr<WorkerConnection> connection_;
  int restarts_ = 0;
  std::uint64_t sequence_base_ = 0, next_sequence_ = 0;  // a worker counts anew
};

// The cameras that a worker program finds. Errors: as the worker's list; device, when it hangs.
Result<std::vector<CameraListing>> ListWorkerCameras(const CameraWorkerLauncher& launch,
                                                     const WorkerLimits& limits = {});

}  // namespace scan
