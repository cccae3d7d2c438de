// One camera: settings asked, settings applied, frames.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "drivers/base/result.h"

namespace scan {

struct CameraInfo {
  std::string id;     // as in the session: c0
  std::string model;  // for people
  int w = 0, h = 0;   // pixels of a still
};

// What is asked for; an empty field is left as it is.
struct CameraSettings {
  std::optional<double> exposure_us;
  std::optional<double> gain;
  friend bool operator==(const CameraSettings&, const CameraSettings&) = default;
};

// What the device says it really used; a field the device does not report is empty.
struct AppliedSettings {
  std::optional<double> exposure_us;
  std::optional<double> gain;
  friend bool operator==(const AppliedSettings&, const AppliedSettings&) = default;
};

enum class ExposureSource { sensor, trigger, hot_shoe, ptp_bound };

// The exposure lies within these monotonic instants; the source says how well they are known.
struct ExposureBound {
  std::int64_t not_before_ns = 0;
  std::int64_t not_after_ns = 0;
  ExposureSource source = ExposureSource::sensor;
  friend bool operator==(const ExposureBound&, const ExposureBound&) = default;
};

// One picture file as the device gave it (or encoded without loss where it gave plain pixels).
struct EncodedFile {
  std::string extension;  // jpg png tif dng nef cr2 arw
  std::vector<std::byte> bytes;
  friend bool operator==(const EncodedFile&, const EncodedFile&) = default;
};

struct Frame {
  std::vector<EncodedFile> files;  // RAW + JPEG of one exposure are one frame
  std::uint64_t sensor_sequence = 0;
  ExposureBound exposure;
  AppliedSettings applied;
};

// Thread contract: one thread at a time.
// Errors: device faults (gone, time-out, corrupt picture), cancelled.
class Camera {
 public:
  virtual ~Camera() = default;
  virtual const CameraInfo& Info() const = 0;
  virtual Result<AppliedSettings> Configure(const CameraSettings& settings) = 0;
  // A frame whose exposure begins after the call, never one out of a queue.
  virtual Result<Frame> Grab(std::stop_token stop) = 0;
};

}  // namespace scan
