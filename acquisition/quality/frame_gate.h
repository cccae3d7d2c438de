// The gate every frame passes before it counts.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/camera/camera.h"

namespace scan {

enum class RejectCause {
  before_settled,  // the exposure may have begun while the axes moved
  settings,        // the device reports other settings than those asked for
  no_picture,      // the frame has no file
  unreadable,      // a file does not decode or is cut off
  wrong_size,      // a picture of another size than the camera's
  duplicate        // the frame before, delivered again
};

std::string_view NameOf(RejectCause cause);  // "before_settled" ...

struct Rejection {
  RejectCause cause = RejectCause::unreadable;
  std::string text;  // one line with the values
};

// What tells a frame from the one before; kept by camera.
struct FrameIdentity {
  std::uint64_t sensor_sequence = 0;
  std::vector<std::string> sha256;  // of each file
};

struct FrameDemand {
  std::int64_t settled_mono_ns = 0;
  CameraSettings asked;
  int w = 0, h = 0;                      // pixels of a jpg, png or tif
  double settings_tolerance_rel = 0.01;  // sensors round an exposure to whole lines
  std::optional<FrameIdentity> last;     // of the same camera; empty for its first frame
};

FrameIdentity IdentityOf(const Frame& frame);

// Why the frame does not count, or nothing. A setting that the device does not report is not
// judged. Thread contract: pure.
std::optional<Rejection> FindRejection(const Frame& frame, const FrameIdentity& identity,
                                       const FrameDemand& demand);

}  // namespace scan
