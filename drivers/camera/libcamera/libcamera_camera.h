// A camera behind libcamera: sensors with an image pipeline (Raspberry Pi), UVC cameras.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/base/clock.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/libcamera/libcamera_config.h"
#include "drivers/camera/libcamera/libcamera_system.h"

namespace scan {

struct LibcameraOptions {
  std::string id = "c0";
  int w = 0, h = 0;  // 0: the largest size of the camera
  LibcameraConfig config;
};

// What happened since the camera was opened.
struct LibcameraCounters {
  std::int64_t frames = 0;     // requests that came back
  std::int64_t stale = 0;      // begun, or perhaps begun, before they were asked for
  std::int64_t unsettled = 0;  // with other settings, or perhaps so
  std::int64_t damaged = 0;    // flagged by the driver, too short, a JPEG that is not whole
};

// Requests are queued all the time; what nobody asked for is dropped. Every request carries the
// settings; a frame counts when its request carried the last ones and its metadata, where they
// report exposure or gain, show them within 1 %. Where they report nothing `settings_frames` more
// are dropped after a change, and Frame::applied stays empty.
// Exposure bound: from SensorTimestamp (which drivers take at the begin of the exposure or of the
// read-out) less the exposure (as reported; else the longer of the one asked for and a frame's
// time) and `latency_frames`, to the request's completion. Without SensorTimestamp it rests on the
// completion less two more frame times, and its source is ptp_bound: request and completion only.
// After a fault the camera is closed; the next call waits for it and opens it again.
class LibcameraCamera final : public Camera {
 public:
  // Opens the camera and sets it up. Errors: device; bad_input for a configuration that it cannot
  // fulfil.
  static Result<std::unique_ptr<LibcameraCamera>> Open(LibcameraOptions options,
                                                       std::shared_ptr<LibcameraSystem> system,
                                                       std::shared_ptr<Clock> clock);

  const CameraInfo& Info() const override { return info_; }
  // Sets them for the requests to come; what applied is only known with a frame, so it gives what
  // the last frame with these very settings reported. A camera without a control takes any
  // plausible value of it and reports none.
  Result<AppliedSettings> Configure(const CameraSettings& settings) override;
  Result<Frame> Grab(std::stop_token stop) override;

  const LibcameraCounters& counters() const { return counters_; }

 private:
  LibcameraCamera(LibcameraOptions options, std::shared_ptr<LibcameraSystem> system,
                  std::shared_ptr<Clock> clock)
      : options_(std::move(options)), system_(std::move(system)), clock_(std::move(clock)) {}

  Status EnsureOpen(std::stop_token stop);
  Result<std::unique_ptr<LibcameraDevice>> WaitForDevice(std::stop_token stop);
  Result<LibcameraStream> ConfigureStream();
  Status Queue(int request);
  Status CheckSettings(const CameraSettings& settings) const;
  void ExpectUnsettledFrames();

  std::int64_t FrameTimeNs(const LibcameraCompletion& done) const;
  ExposureBound BoundOf(const LibcameraCompletion& done) const;
  bool Settled(const LibcameraCompletion& done);
  std::optional<std::string> FindDamage(const LibcameraCompletion& done) const;
  void NoteInterval(const LibcameraCompletion& done);
  // The frame, if it counts; `damage` says what was wrong with one that does not.
  Result<std::optional<Frame>> Judge(const LibcameraCompletion& done, std::int64_t asked_ns,
                                     std::string& damage);
  Result<Frame> GrabOpened(std::int64_t asked_ns, std::stop_token stop);

  LibcameraOptions options_;
  std::shared_ptr<LibcameraSystem> system_;
  std::shared_ptr<Clock> clock_;
  CameraInfo info_;
  std::unique_ptr<LibcameraDevice> device_;
  LibcameraStream stream_;
  std::map<std::string, LibcameraRange> controls_;
  RequestSettings asked_;
  AppliedSettings reported_;  // by the last frame that counted
  std::vector<int> generation_of_request_;
  int generation_ = 0;  // counts the changes of the settings
  int unsettled_frames_ = 0;
  std::int64_t settings_changed_ns_ = 0;
  // Of the stream that runs.
  std::optional<std::uint32_t> last_sequence_;
  std::int64_t last_stamp_ns_ = 0;
  std::int64_t interval_ns_ = 0;     // between the last two frames; 0: not known
  std::uint64_t sequence_base_ = 0;  // libcamera counts anew in every stream
  std::uint64_t sequence_ = 0;
  LibcameraCounters counters_;
};

// The camera that `wanted` (id or model, empty: the only one) names. Errors: device when it is not
// there, bad_input when several fit.
Result<LibcameraEntry> FindLibcamera(const std::vector<LibcameraEntry>& cameras,
                                     const std::string& wanted);

}  // namespace scan
