#include "drivers/camera/sim/sim_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "drivers/base/rng.h"
#include "drivers/camera/encode_picture.h"

namespace scan {
namespace {

constexpr int kFirstLateGrab = 3;
constexpr double kDarkLevel = 2;  // grey level of a picture without light

// Adds Gaussian noise whose variance is half read-out, half photon noise at mid grey. Values come
// from a table of normals, drawn by a counter-free generator: the same for the same seed.
void AddNoise(cv::Mat& bgr, double sigma_mid, std::uint64_t seed) {
  if (sigma_mid <= 0) return;
  static const std::array<float, 4096> normals = [] {
    std::array<float, 4096> table{};
    Rng rng(0x5ca11ab1e);
    for (float& value : table) value = static_cast<float>(rng.Normal());
    return table;
  }();
  std::array<float, 256> sigma{};
  for (int value = 0; value < 256; ++value) {
    sigma[static_cast<std::size_t>(value)] =
        static_cast<float>(sigma_mid * std::sqrt(0.5 + 0.5 * value / 128.0));
  }
  Rng rng(seed);
  const int row_values = bgr.cols * 3;
  for (int row = 0; row < bgr.rows; ++row) {
    std::uint8_t* p = bgr.ptr<std::uint8_t>(row);
    for (int i = 0; i < row_values;) {
      std::uint64_t bits = rng.Next();
      for (int k = 0; k < 5 && i < row_values; ++k, ++i, bits >>= 12) {
        const float noisy = static_cast<float>(p[i]) + sigma[p[i]] * normals[bits & 4095U];
        p[i] = static_cast<std::uint8_t>(std::clamp(noisy + 0.5F, 0.0F, 255.0F));
      }
    }
  }
}

bool SamePlace(const TrueState& a, const TrueState& b) {
  return a.turntable_rad == b.turntable_rad && a.lift_mm == b.lift_mm &&
         a.camera_from_model.isometry().matrix() == b.camera_from_model.isometry().matrix();
}

}  // namespace

SimCamera::SimCamera(SimCameraOptions options, std::shared_ptr<Clock> clock, StateSource state_at,
                     SceneRenderer renderer, TruthSink truth_sink)
    : options_(std::move(options)),
      clock_(std::move(clock)),
      state_at_(std::move(state_at)),
      renderer_(std::move(renderer)),
      truth_sink_(std::move(truth_sink)),
      asked_{options_.exposure_us, options_.gain},
      applied_(asked_),
      origin_ns_(clock_->Now().mono_ns) {}

Result<AppliedSettings> SimCamera::Configure(const CameraSettings& settings) {
  const double exposure_us = settings.exposure_us.value_or(*asked_.exposure_us);
  const double gain = settings.gain.value_or(*asked_.gain);
  if (!(exposure_us >= 1 && exposure_us <= 10e6) || !(gain >= 1 && gain <= 64)) {
    return BadInput(fmt::format("exposure {} us, gain {}", exposure_us, gain), options_.info.id,
                    "exposure is 1 to 10000000 us, gain 1 to 64");
  }
  asked_ = {exposure_us, gain};
  frames_until_applied_ = options_.settings_delay_frames;
  if (frames_until_applied_ == 0) applied_ = asked_;
  return asked_;
}

Result<SimCamera::Exposure> SimCamera::Expose(std::stop_token stop) {
  const auto exposure_ns = [&] {
    return static_cast<std::int64_t>(std::llround(*applied_.exposure_us * 1000));
  };
  const std::int64_t interval_ns = std::max(options_.frame_interval_ns, exposure_ns());
  const std::int64_t asked_ns = clock_->Now().mono_ns;
  const std::int64_t slot = (asked_ns - origin_ns_) / interval_ns + 1;
  Exposure exposure;
  exposure.sequence = previous_ ? previous_->sequence + 1 : 0;
  if (frames_until_applied_ > 0) {
    --frames_until_applied_;
  } else {
    applied_ = asked_;
  }
  exposure.applied = applied_;
  exposure.bound.not_before_ns = origin_ns_ + slot * interval_ns;
  exposure.bound.not_after_ns = exposure.bound.not_before_ns + exposure_ns();
  exposure.bound.source = ExposureSource::sensor;
  const std::int64_t middle_ns = exposure.bound.not_before_ns + exposure_ns() / 2;
  const auto look = [&](std::int64_t when_ns, TrueState& state) {
    if (!clock_->SleepUntil(when_ns, stop)) return false;
    state = state_at_(when_ns);
    state.exposure_us = *exposure.applied.exposure_us;
    state.noise_seed = Rng(options_.seed + 0x9e37 * (exposure.sequence + 1)).Next();
    return true;
  };
  if (!look(exposure.bound.not_before_ns, exposure.begin) || !look(middle_ns, exposure.middle) ||
      !look(exposure.bound.not_after_ns, exposure.end)) {
    return Cancelled("camera " + options_.info.id);
  }
  return exposure;
}

Result<Frame> SimCamera::Grab(std::stop_token stop) {
  if (stop.stop_requested()) return Cancelled("camera " + options_.info.id);
  ++grabs_;
  const bool late =
      previous_ && grabs_ >= kFirstLateGrab && grabs_ < kFirstLateGrab + options_.late_frames;
  if (!late) {
    SCAN_TRY(previous_, Expose(stop));
  }
  return Develop(*previous_);
}

Result<Frame> SimCamera::Develop(const Exposure& exposure) {
  cv::Mat picture;
  const TrueState& middle = exposure.middle;
  if (!middle.light_on) {
    picture = cv::Mat(options_.info.h, options_.info.w, CV_8UC3, cv::Scalar::all(kDarkLevel));
  } else {
    SCAN_TRY(picture, renderer_(middle));
    if (!SamePlace(exposure.begin, middle) || !SamePlace(middle, exposure.end)) {
      SCAN_TRY(const cv::Mat begin, renderer_(exposure.begin));
      SCAN_TRY(const cv::Mat end, renderer_(exposure.end));
      cv::Mat sum;
      picture.convertTo(sum, CV_32FC3);
      cv::accumulate(begin, sum);
      cv::accumulate(end, sum);
      sum.convertTo(picture, CV_8UC3, 1.0 / 3.0);
    } else {
      picture = picture.clone();  // the renderer may keep what it gave
    }
  }
  if (picture.type() != CV_8UC3 || picture.cols != options_.info.w ||
      picture.rows != options_.info.h) {
    return Failed(fmt::format("the renderer gave {} x {}, type {}", picture.cols, picture.rows,
                              picture.type()),
                  options_.info.id, "it must give CV_8UC3 of the size of the camera");
  }
  AddNoise(picture, options_.noise * *exposure.applied.gain, middle.noise_seed);

  SCAN_TRY(EncodedFile file, EncodePicture(picture, options_.format, options_.jpeg_quality));
  if (truth_sink_) {
    truth_sink_({options_.info.id, exposure.sequence, exposure.bound.not_before_ns, middle});
  }
  Frame frame;
  frame.files.push_back(std::move(file));
  frame.sensor_sequence = exposure.sequence;
  frame.exposure = exposure.bound;
  frame.applied = exposure.applied;
  return frame;
}

}  // namespace scan
