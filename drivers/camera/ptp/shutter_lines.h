// A camera's wired release and its flash contact, where the station has them.
#pragma once

#include <cstdint>
#include <vector>

#include "drivers/base/result.h"

namespace scan {

// Thread contract: one thread at a time. Errors: device faults of the lines.
class ShutterLines {
 public:
  virtual ~ShutterLines() = default;
  virtual bool has_release() const = 0;
  virtual bool has_hot_shoe() const = 0;
  // Closes the release contact, or opens it. Precondition: has_release().
  virtual Status Press(bool pressed) = 0;
  // Monotonic instants at which the flash contact closed since the last call, earliest first: once
  // for each exposure, when the first curtain has opened. Precondition: has_hot_shoe().
  virtual Result<std::vector<std::int64_t>> TakeHotShoe() = 0;
};

}  // namespace scan
