// libcamera's simulated twin: a sensor that runs freely, requests that it fills, metadata, faults.
#pragma once

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "drivers/base/clock.h"
#include "drivers/camera/encode_picture.h"
#include "drivers/camera/libcamera/libcamera_format.h"
#include "drivers/camera/libcamera/libcamera_system.h"

namespace scan {

struct SimulatedLibcameraOptions {
  std::string format = "YUYV";  // the other one offered is MJPEG
  bool stills = true;           // else only a viewfinder
  bool reports_settings = true, reports_stamp = true;
  int delay_frames = 2;  // until the settings of a request apply
  int held_frames = 0;   // the stamp is so many frames late
  std::int64_t interval_ns = 20'000'000;
  int fails_at = 0;  // this call of the seam, from 1, finds the camera removed
  int silent_from = 1 << 30, damaged_from = 1 << 30, cancelled_at = 1 << 30;  // frames, from 0
  int damaged_until = 1 << 30;
};

// What outlives the devices.
struct SimulatedLibcameraState {
  int calls = 0, open = 0, opened = 0, frames = 0;
};

class SimulatedLibcameraDevice final : public LibcameraDevice {
 public:
  SimulatedLibcameraDevice(SimulatedLibcameraOptions options, std::shared_ptr<Clock> clock,
                           std::shared_ptr<SimulatedLibcameraState> state)
      : options_(std::move(options)), clock_(std::move(clock)), state_(std::move(state)) {
    ++state_->open;
    ++state_->opened;
  }
  ~SimulatedLibcameraDevice() override { --state_->open; }

  const LibcameraEntry& entry() const override { return entry_; }

  std::vector<LibcameraOffer> Offers(LibcameraRole role) override {
    if (role == LibcameraRole::still && !options_.stills) return {};
    return {{"XVUY8888", {{4000, 3000}}}, {options_.format, {{64, 48}, {96, 64}}}};
  }

  Result<LibcameraStream> Configure(LibcameraRole, const std::string& format, int w,
                                    int h) override {
    SCAN_CHECK(Call());
    stream_.format.format = FindLibcameraFormat(format);
    stream_.format.w = w;
    stream_.format.h = h;
    stream_.format.bytes_per_line = format == "YUYV" ? 2 * w : 0;
    stream_.requests = 4;
    return stream_;
  }

  std::map<std::string, LibcameraRange> Controls() override {
    return {{"ExposureTime", {100, 1e6}}, {"AnalogueGain", {1, 16}}};
  }

  Status Start(const std::map<std::string, std::string>&) override {
    SCAN_CHECK(Call());
    origin_ns_ = clock_->Now().mono_ns;
    return {};
  }

  Status Queue(int request, const RequestSettings& settings) override {
    SCAN_CHECK(Call());
    queue_.push_back({request, settings, clock_->Now().mono_ns});
    return {};
  }

  Result<std::optional<LibcameraCompletion>> Next(std::int64_t deadline_ns,
                                                  std::stop_token stop) override {
    SCAN_CHECK(Call());
    for (;;) {
      Run(clock_->Now().mono_ns);
      if (!done_.empty()) {
        std::optional<LibcameraCompletion> next(done_.front());
        done_.pop_front();
        next->bytes = picture_;
        return next;
      }
      const std::int64_t until_ns = std::min(deadline_ns, EndOf(frame_));
      if (!clock_->SleepUntil(until_ns, stop)) return Cancelled("simulated libcamera");
      if (until_ns == deadline_ns) return std::optional<LibcameraCompletion>();
    }
  }

 private:
  struct Queued {
    int request = 0;
    RequestSettings settings;
    std::int64_t queued_ns = 0;
  };

  Status Call() {
    if (++state_->calls == options_.fails_at)
      return DeviceFault("the camera was removed", "simulated libcamera", "plug it in again");
    return {};
  }

  std::int64_t BeginOf(std::int64_t frame) const {
    return origin_ns_ + frame * options_.interval_ns;
  }
  std::int64_t EndOf(std::int64_t frame) const {
    return BeginOf(frame) + ExposureNs() + options_.interval_ns / 2;
  }
  std::int64_t ExposureNs() const { return std::llround(1e3 * applied_.exposure_us.value_or(0)); }

  // Every frame that has ended by now fills the oldest request that was queued before it began.
  void Run(std::int64_t now_ns) {
    while (EndOf(frame_) <= now_ns) {
      const std::int64_t frame = frame_++;
      if (queue_.empty() || queue_.front().queued_ns > BeginOf(frame)) continue;
      if (state_->frames >= options_.silent_from) continue;
      const Queued queued = queue_.front();
      queue_.pop_front();
      coming_.push_back(queued.settings);
      if (static_cast<int>(coming_.size()) > options_.delay_frames) {
        applied_ = coming_.front();
        coming_.pop_front();
      }
      LibcameraCompletion done;
      done.request = queued.request;
      done.sequence = static_cast<std::uint32_t>(frame);
      done.completed_ns = EndOf(frame);
      if (options_.reports_stamp)
        done.sensor_timestamp_ns = BeginOf(frame) + options_.held_frames * options_.interval_ns;
      if (options_.reports_settings) {
        done.exposure_us = applied_.exposure_us.value_or(5000);
        done.gain = applied_.gain.value_or(1);
        done.frame_duration_ns = options_.interval_ns;
      }
      done.cancelled = state_->frames == options_.cancelled_at;
      done.damaged =
          state_->frames >= options_.damaged_from && state_->frames < options_.damaged_until;
      ++state_->frames;
      done_.push_back(done);
      Paint();
    }
  }

  void Paint() {
    const StreamFormat& format = stream_.format;
    if (format.format->layout == PixelLayout::mjpeg) {
      const auto file =
          EncodePicture(cv::Mat(format.h, format.w, CV_8UC3, cv::Scalar(90, 60, 30)), "jpg", 90);
      picture_ = file ? file->bytes : std::vector<std::byte>();
    } else {
      picture_.assign(PictureBytes(*format.format, format.w, format.h, format.bytes_per_line),
                      static_cast<std::byte>(100 + frame_ % 50));
    }
  }

  SimulatedLibcameraOptions options_;
  std::shared_ptr<Clock> clock_;
  std::shared_ptr<SimulatedLibcameraState> state_;
  LibcameraEntry entry_{"/base/soc/sim@10", "simsensor"};
  LibcameraStream stream_;
  std::int64_t origin_ns_ = 0, frame_ = 0;
  std::deque<Queued> queue_;
  std::deque<RequestSettings> coming_;
  RequestSettings applied_;
  std::deque<LibcameraCompletion> done_;
  std::vector<std::byte> picture_;
};

class SimulatedLibcamera final : public LibcameraSystem {
 public:
  SimulatedLibcamera(SimulatedLibcameraOptions options, std::shared_ptr<Clock> clock)
      : options_(std::move(options)), clock_(std::move(clock)) {}

  Result<std::vector<LibcameraEntry>> List() override {
    return std::vector<LibcameraEntry>{{"/base/soc/sim@10", "simsensor"},
                                       {"/base/soc/other@36", "another"}};
  }
  Result<std::unique_ptr<LibcameraDevice>> Open(const std::string&) override {
    return std::make_unique<SimulatedLibcameraDevice>(options_, clock_, state);
  }

  std::shared_ptr<SimulatedLibcameraState> state = std::make_shared<SimulatedLibcameraState>();

 private:
  SimulatedLibcameraOptions options_;
  std::shared_ptr<Clock> clock_;
};

}  // namespace scan
