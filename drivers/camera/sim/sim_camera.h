// The camera's simulated twin: renders the true state of the world.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>

#include "drivers/base/clock.h"
#include "drivers/camera/camera.h"
#include "drivers/station/true_state.h"

namespace scan {

// The truth of one frame, in the order of the frames; kept out of the session. A frame of the
// session is found by camera and sensor sequence.
struct FrameTruth {
  std::string camera_id;
  std::uint64_t sensor_sequence = 0;
  std::int64_t exposure_start_ns = 0;  // monotonic
  TrueState state;                     // at the middle of the exposure
};

// Called from the thread that grabs, once a frame.
using TruthSink = std::function<void(const FrameTruth&)>;

struct SimCameraOptions {
  CameraInfo info;
  double exposure_us = 8000;  // at start
  double gain = 1;
  std::uint64_t seed = 1;
  double noise = 1;            // grey levels at mid grey, 1 sigma, at gain 1
  std::string format = "jpg";  // jpg (4:4:4) png
  int jpeg_quality = 95;
  std::int64_t frame_interval_ns = 100'000'000;
  int settings_delay_frames = 0;  // the setting asked applies to the frame this many later
  int late_frames = 0;            // so many grabs, from the third on, give the frame before
};

// A free-running camera: it exposes once per frame interval, and Grab gives the first frame whose
// exposure begins after the call. Where the stage moves during the exposure the picture is the
// mean of its beginning, middle and end.
class SimCamera final : public Camera {
 public:
  // What the camera would see now; called at instants not before the last step edge.
  using StateSource = std::function<TrueState(std::int64_t mono_ns)>;

  SimCamera(SimCameraOptions options, std::shared_ptr<Clock> clock, StateSource state_at,
            SceneRenderer renderer, TruthSink truth_sink);

  const CameraInfo& Info() const override { return options_.info; }
  Result<AppliedSettings> Configure(const CameraSettings& settings) override;
  Result<Frame> Grab(std::stop_token stop) override;

 private:
  struct Exposure {
    TrueState begin, middle, end;
    ExposureBound bound;
    AppliedSettings applied;
    std::uint64_t sequence = 0;
  };
  Result<Exposure> Expose(std::stop_token stop);
  Result<Frame> Develop(const Exposure& exposure);

  SimCameraOptions options_;
  std::shared_ptr<Clock> clock_;
  StateSource state_at_;
  SceneRenderer renderer_;
  TruthSink truth_sink_;
  AppliedSettings asked_, applied_;
  int frames_until_applied_ = 0;
  std::int64_t origin_ns_;  // of the frame rhythm
  int grabs_ = 0;
  std::optional<Exposure> previous_;
};

}  // namespace scan
