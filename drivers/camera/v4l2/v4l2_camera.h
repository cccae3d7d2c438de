// A camera behind the kernel's V4L2 interface: UVC cameras, grabbers, the kernel's test drivers.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/base/clock.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/v4l2/v4l2_config.h"
#include "drivers/camera/v4l2/v4l2_controls.h"
#include "drivers/camera/v4l2/v4l2_device.h"
#include "drivers/camera/v4l2/v4l2_stream.h"

namespace scan {

struct V4l2CameraOptions {
  std::string id = "c0";
  int w = 0, h = 0;  // 0: the largest size of the camera
  V4l2Config config;
};

// What happened since the camera was opened.
struct V4l2Counters {
  std::int64_t frames = 0;      // taken out of the queue
  std::int64_t stale = 0;       // begun, or perhaps begun, before they were asked for
  std::int64_t unsettled = 0;   // dropped because a control had just been changed
  std::int64_t damaged = 0;     // flagged by the driver, of a wrong size, a JPEG that is not whole
  std::int64_t disordered = 0;  // sequence number or time stamp not after the frame before
  std::int64_t restarts = 0;    // of the stream
};

// The stream runs from Open on; frames that nobody asked for are dropped.
// A frame counts when its exposure began after the call: its stamp (arrival of its first bytes),
// less the exposure time and `latency_frames` frame intervals, is not before the call. UVC carries
// no exposure stamp, so this bound is what Frame::exposure states.
// Copies of a picture's bytes: none until it is decoded; one for the file of an MJPEG frame.
// After a fault (unplugged, silent, changed format, failed call) the device is closed, waited for,
// opened and set up again once within the call; then it is an error, and the next call begins anew.
// A call ends within 2 (time-out + reconnection) + (40 frame intervals and exposures).
class V4l2Camera final : public Camera {
 public:
  // Opens the camera and sets it up. Errors: device; bad_input for a configuration that it cannot
  // fulfil.
  static Result<std::unique_ptr<V4l2Camera>> Open(V4l2CameraOptions options,
                                                  std::shared_ptr<V4l2System> system,
                                                  std::shared_ptr<Clock> clock);

  const CameraInfo& Info() const override { return info_; }
  // A camera without an exposure control takes any plausible exposure and reports none. Errors
  // also: bad_input for an exposure more than 1 % off the camera's steps (100 us).
  Result<AppliedSettings> Configure(const CameraSettings& settings) override;
  Result<Frame> Grab(std::stop_token stop) override;

  const V4l2Counters& counters() const { return counters_; }
  // Null while the camera is gone.
  V4l2Stream* stream() { return stream_.get(); }
  V4l2Device* device() { return device_.get(); }

 private:
  V4l2Camera(V4l2CameraOptions options, std::shared_ptr<V4l2System> system,
             std::shared_ptr<Clock> clock)
      : options_(std::move(options)), system_(std::move(system)), clock_(std::move(clock)) {}

  template <class T, class Work>
  Result<T> WithRecovery(std::stop_token stop, Work work);
  Status EnsureOpen(std::stop_token stop);
  Result<std::unique_ptr<V4l2Device>> WaitForDevice(std::stop_token stop);
  Status LockAutomatics();
  Status ApplyConfiguredControls();
  Status ApplySettings(const CameraSettings& settings);
  Status Write(const V4l2Control& control, std::int64_t value);
  Status CheckSettings(const CameraSettings& settings) const;
  Result<AppliedSettings> ReadSettings();
  void Close();

  const V4l2Control* ExposureControl() const;
  const V4l2Control* GainControl() const;
  void ExpectUnsettledFrames();
  std::int64_t ExposureNs() const;  // the longest that a frame still to come may have
  std::int64_t FrameTimeNs() const;
  ExposureBound BoundOf(const MappedFrame& frame) const;
  bool FollowsThePrevious(const MappedFrame& frame);
  std::optional<std::string> FindDamage(const MappedFrame& frame) const;
  struct Damage {  // seen in one call
    int count = 0;
    std::string last;
    void Add(std::string what) {
      ++count;
      last = std::move(what);
    }
  };
  // The frame, if it counts; else what speaks against it is counted.
  Result<std::optional<Frame>> Judge(const MappedFrame& mapped, std::int64_t asked_ns,
                                     Damage& damage);
  Result<Frame> GrabOnce(std::int64_t asked_ns, std::stop_token stop);

  V4l2CameraOptions options_;
  std::shared_ptr<V4l2System> system_;
  std::shared_ptr<Clock> clock_;
  CameraInfo info_;
  std::unique_ptr<V4l2Device> device_;
  std::unique_ptr<V4l2Stream> stream_;  // destroyed before its device
  std::vector<V4l2Control> controls_;
  CameraSettings asked_;     // set up again after a reconnection
  AppliedSettings applied_;  // as last read back
  std::int64_t settings_changed_ns_ = 0;
  int unsettled_frames_ = 0;
  double longest_exposure_us_ = 0;  // of those set since the last frame that counted
  // Of the stream that runs.
  std::optional<std::uint32_t> last_sequence_;
  std::int64_t last_stamp_ns_ = 0;
  std::uint64_t sequence_base_ = 0;  // the driver counts anew in every stream
  std::uint64_t sequence_ = 0;
  V4l2Counters counters_;
};

}  // namespace scan
