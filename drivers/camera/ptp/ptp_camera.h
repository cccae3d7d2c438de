// A still camera on USB, released by its own protocol (PTP).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/base/clock.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/ptp/ptp_config.h"
#include "drivers/camera/ptp/ptp_settings.h"
#include "drivers/camera/ptp/shutter_lines.h"
#include "drivers/camera/ptp/watched_photo_camera.h"

namespace scan {

struct PtpCameraOptions {
  std::string id = "c0";
  int w = 0, h = 0;  // of its JPEG; 0: any
  PtpConfig config;
};

// What happened since the camera was opened.
struct PtpCounters {
  std::int64_t frames = 0;
  std::int64_t stale = 0;      // files of exposures that nobody here asked for, or too late
  std::int64_t undeleted = 0;  // files that the camera did not delete when asked to
  std::int64_t reopened = 0;
};

// Every frame is an exposure of its own: events of earlier ones are drained, the settings are set
// and read back, the shutter is released, the files that come then are this frame's.
// A camera tells no exposure time stamp, so the bound is what is seen of it: from just before the
// release to the arrival of the first file (ptp_bound); with a flash contact on a GPIO line, from
// `curtain_ms` before its closing to exposure + `curtain_ms` after it (hot_shoe).
// Exposure times are those marked on the camera (1/125: 8000 us); gain is ISO over base_iso.
// Whoever presses the camera's own button just before a release is not told apart without a flash
// contact, if his file comes after the shortest time that the exposure may take.
// After a fault of the connection the camera is opened again once within the call.
// Time-outs are kept while libgphoto2 returns at all: run it in a process that can be killed.
class PtpCamera final : public Camera {
 public:
  // Opens the camera, checks battery and card. `lines` may be null. Errors: device; bad_input for
  // a configuration that it cannot fulfil.
  static Result<std::unique_ptr<PtpCamera>> Open(PtpCameraOptions options,
                                                 std::shared_ptr<PhotoSystem> system,
                                                 std::unique_ptr<ShutterLines> lines,
                                                 std::shared_ptr<Clock> clock);

  const CameraInfo& Info() const override { return info_; }
  // Errors also: bad_input for an exposure or gain more than 1 % off what the camera offers.
  Result<AppliedSettings> Configure(const CameraSettings& settings) override;
  Result<Frame> Grab(std::stop_token stop) override;

  const PtpCounters& counters() const { return counters_; }

 private:
  PtpCamera(PtpCameraOptions options, std::shared_ptr<PhotoSystem> system,
            std::unique_ptr<ShutterLines> lines, std::shared_ptr<Clock> clock)
      : options_(std::move(options)),
        system_(std::move(system)),
        lines_(std::move(lines)),
        clock_(std::move(clock)) {}

  struct Shot {  // one exposure as it came
    std::int64_t released_ns = 0, first_file_ns = 0;
    std::vector<PhotoFile> files;
  };
  Status EnsureOpen(std::stop_token stop);
  Status OpenOnce();
  Result<Frame> GrabOnce(std::stop_token stop);
  Result<Shot> Release(std::stop_token stop);
  Status Collect(Shot& shot, const AppliedSettings& applied, std::stop_token stop);
  Result<ExposureBound> BoundOf(const Shot& shot, const AppliedSettings& applied);
  Result<Frame> Fetch(const Shot& shot);
  void FindPartners(Shot& shot);
  void Remove(const PhotoFile& file);

  PhotoStatus HandleStale(const PhotoEvent& event);
  PhotoStatus Pump(int timeout_ms);
  Status Drain(std::stop_token stop);
  Result<AppliedSettings> Hold();
  Result<AppliedSettings> ConfigureOnce(const CameraSettings& wish);
  Result<Frame> Develop(const Shot& shot, const AppliedSettings& applied);
  template <class T, class Work>
  Result<T> WithRecovery(std::stop_token stop, Work work);
  tl::unexpected<Error> Fault(const PhotoFault& fault) const;
  std::int64_t Now() { return clock_->Now().mono_ns; }

  PtpCameraOptions options_;
  std::shared_ptr<PhotoSystem> system_;
  std::unique_ptr<ShutterLines> lines_;
  std::shared_ptr<Clock> clock_;
  CameraInfo info_;
  std::string where_;
  std::unique_ptr<WatchedPhotoCamera> camera_;  // null while it is gone
  std::optional<PtpSettings> settings_;
  CameraSettings asked_;
  bool unsettled_ = false;            // files of a shot that was given up may still come
  std::int64_t given_up_end_ns_ = 0;  // of the exposure of that shot
  std::uint64_t sequence_ = 0;
  PtpCounters counters_;
};

}  // namespace scan
