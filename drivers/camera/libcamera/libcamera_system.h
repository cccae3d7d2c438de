// libcamera as the camera driver needs it: a thin seam, behind which a simulated one may stand.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "drivers/base/result.h"
#include "drivers/camera/v4l2/v4l2_stream.h"

namespace scan {

struct LibcameraEntry {
  std::string id, model;
};

enum class LibcameraRole { still, viewfinder, raw };

// A pixel format by libcamera's name, with its sizes (w, h).
struct LibcameraOffer {
  std::string format;
  std::vector<std::pair<int, int>> sizes;
};

struct LibcameraStream {
  StreamFormat format;
  int requests = 0;  // that may be queued at a time, numbered from 0
};

struct LibcameraRange {
  double min = 0, max = 0;
};

// What a request asks for; an empty field is left to the camera.
struct RequestSettings {
  std::optional<double> exposure_us, gain;
  bool lock_automatics = true;
};

// A request that came back. What its metadata do not report is empty.
struct LibcameraCompletion {
  int request = 0;
  bool cancelled = false;  // it holds no picture
  bool damaged = false;    // the driver says that its data are
  bool startup = false;    // of a camera that is still finding its settings
  std::uint32_t sequence = 0;
  std::int64_t completed_ns = 0;  // monotonic
  std::optional<std::int64_t> sensor_timestamp_ns, frame_duration_ns;
  std::optional<double> exposure_us, gain;
  std::span<const std::byte> bytes;  // of its buffer, until it is queued again
};

// One camera, held by nobody else. Errors: device faults; once the camera was removed every call
// fails. Thread contract: one thread.
class LibcameraDevice {
 public:
  virtual ~LibcameraDevice() = default;  // stops and releases it
  virtual const LibcameraEntry& entry() const = 0;
  // Empty where it does not have the role.
  virtual std::vector<LibcameraOffer> Offers(LibcameraRole role) = 0;
  // `format` and size are among the offers. Errors also: bad_input when the camera adjusts them.
  virtual Result<LibcameraStream> Configure(LibcameraRole role, const std::string& format, int w,
                                            int h) = 0;
  // The ranges of its numeric controls by libcamera's name; they may change when it is configured.
  virtual std::map<std::string, LibcameraRange> Controls() = 0;
  // `fixed` goes with every request. Errors also: bad_input for controls that it has not.
  virtual Status Start(const std::map<std::string, std::string>& fixed) = 0;
  virtual Status Queue(int request, const RequestSettings& settings) = 0;
  // The next request that came back, in order; without a value when the time (monotonic) is over.
  // Errors also: cancelled.
  virtual Result<std::optional<LibcameraCompletion>> Next(std::int64_t deadline_ns,
                                                          std::stop_token stop) = 0;
};

class LibcameraSystem {
 public:
  virtual ~LibcameraSystem() = default;
  // Looks anew. Precondition: no device of this system is open.
  virtual Result<std::vector<LibcameraEntry>> List() = 0;
  // Errors: device, when it is not there or another program holds it.
  virtual Result<std::unique_ptr<LibcameraDevice>> Open(const std::string& id) = 0;
};

}  // namespace scan
