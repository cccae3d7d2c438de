#include "firmware-host/camera_worker/worker_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drivers/base/log.h"
#include "firmware-host/camera_worker/camera_messages.h"
#include "firmware-host/camera_worker/worker_connection.h"

namespace scan {

Result<std::unique_ptr<WorkerCamera>> WorkerCamera::Open(WorkerCameraOptions options,
                                                         CameraWorkerLauncher launch) {
  std::unique_ptr<WorkerCamera> camera(new WorkerCamera(std::move(options), std::move(launch)));
  SCAN_CHECK(camera->WithWorker<AppliedSettings>(
      "open", {}, [&]() -> Result<AppliedSettings> { return AppliedSettings{}; }));
  return camera;
}

WorkerCamera::WorkerCamera(WorkerCameraOptions options, CameraWorkerLauncher launch)
    : options_(std::move(options)), launch_(std::move(launch)) {}

WorkerCamera::~WorkerCamera() = default;

// Makes the call, with a worker that is started where none runs; begins anew where it was lost.
template <class T, class Use>
Result<T> WorkerCamera::WithWorker(const char* doing, std::stop_token stop, Use use) {
  for (int restart = 0;; ++restart) {
    Result<T> result = [&]() -> Result<T> {
      SCAN_CHECK(EnsureConnected(stop));
      return use();
    }();
    if (connection_ && connection_->lost()) connection_.reset();
    if (result || result.error().kind != ErrorKind::device) return result;
    // The camera's own faults too: a fresh process opens it anew.
    connection_.reset();
    if (stop.stop_requested()) return Cancelled("camera " + options_.id);
    if (restart >= options_.limits.restarts) {
      Error fault = std::move(result).error();
      fault.where = "camera " + options_.id + ", " + fault.where;
      fault.what += fmt::format(" (given up after {} restarts)", restart);
      return tl::unexpected(std::move(fault));
    }
    Recover(result.error(), doing, restart + 1);
  }
}

void WorkerCamera::Recover(const Error& fault, const char* doing, int restart) {
  Log(LogLevel::warning, "camera_worker_restart",
      {{"camera", options_.id},
       {"doing", doing},
       {"fault", ToString(fault)},
       {"restart", fmt::format("{} of {}", restart, options_.limits.restarts)}});
  ++restarts_;
  if (restart < options_.limits.restarts || !options_.on_hang) return;
  // Where the reset fails the last restart still has its chance.
  const Status reset = options_.on_hang();
  Log(LogLevel::warning, "camera_reset",
      {{"camera", options_.id}, {"outcome", reset ? "done" : ToString(reset.error())}});
}

Status WorkerCamera::EnsureConnected(std::stop_token stop) {
  if (connection_) return {};
  SCAN_TRY(auto connection, WorkerConnection::Start(launch_, options_.limits));
  const bool first = info_.w == 0 && !options_.first_options.empty();
  const std::string& options = first ? options_.first_options : options_.options;
  SCAN_TRY(const WorkerMessage opened,
           connection->Call("open", {{"options", options}}, options_.limits.open, stop));
  Result<CameraInfo> info = CameraInfoFromJson(opened.body);
  if (!info)
    return tl::unexpected(connection->Lose("answered nonsense: " + ToString(info.error())));
  info->id = options_.id;
  if (info_.w != 0 && (info->w != info_.w || info->h != info_.h))
    return DeviceFault(fmt::format("the camera came back with pictures of {} x {} instead of {} x "
                                   "{}",
                                   info->w, info->h, info_.w, info_.h),
                       options_.id, "check which camera is plugged in");
  info_ = std::move(*info);
  sequence_base_ = next_sequence_;
  connection_ = std::move(connection);
  if (asked_ == CameraSettings{}) return {};
  if (const auto applied = SendSettings(asked_); !applied) {
    connection_.reset();  // no picture is taken with other settings than those asked for
    return tl::unexpected(applied.error());
  }
  return {};
}

Result<AppliedSettings> WorkerCamera::SendSettings(const CameraSettings& settings) {
  SCAN_TRY(const WorkerMessage answer,
           connection_->Call("configure", ToJson(settings), options_.limits.configure));
  Result<AppliedSettings> applied = AppliedSettingsFromJson(answer.body);
  if (!applied)
    return tl::unexpected(connection_->Lose("answered nonsense: " + ToString(applied.error())));
  return applied;
}

Result<AppliedSettings> WorkerCamera::Configure(const CameraSettings& settings) {
  SCAN_TRY(const AppliedSettings applied,
           WithWorker<AppliedSettings>("configure", {}, [&] { return SendSettings(settings); }));
  if (settings.exposure_us) asked_.exposure_us = settings.exposure_us;
  if (settings.gain) asked_.gain = settings.gain;
  return applied;
}

Result<Frame> WorkerCamera::Grab(std::stop_token stop) {
  if (stop.stop_requested()) return Cancelled("camera " + options_.id);
  const double exposure_us = asked_.exposure_us.value_or(0);
  const auto limit =
      options_.limits.grab + std::chrono::milliseconds(std::llround(2 * exposure_us / 1000));
  return WithWorker<Frame>("grab", stop, [&]() -> Result<Frame> {
    SCAN_TRY(const WorkerMessage answer,
             connection_->Call("grab", nlohmann::json::object(), limit, stop));
    Result<Frame> frame = UnpackFrame(answer.body, answer.files, options_.limits.max_picture_bytes);
    if (!frame)
      return tl::unexpected(connection_->Lose("answered nonsense: " + ToString(frame.error())));
    frame->sensor_sequence += sequence_base_;
    next_sequence_ = frame->sensor_sequence + 1;
    return frame;
  });
}

Result<std::vector<CameraListing>> ListWorkerCameras(const CameraWorkerLauncher& launch,
                                                     const WorkerLimits& limits) {
  SCAN_TRY(const auto connection, WorkerConnection::Start(launch, limits));
  SCAN_TRY(const WorkerMessage answer,
           connection->Call("list", nlohmann::json::object(), limits.open));
  return CameraListingsFromJson(answer.body);
}

}  // namespace scan
