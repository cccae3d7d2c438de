// A lamp as its driver sees it: a brightness. Captures see a Light (light.h).
#pragma once

#include "drivers/base/result.h"

namespace scan {

// Dark when it is opened and when it is destroyed.
// Thread contract: any thread. Errors: bad_input for a level outside 0 to 1 or one that the lamp
// cannot give; device faults.
class Lamp {
 public:
  virtual ~Lamp() = default;
  // 0: off, 1: all of it.
  virtual Status SetLevel(double level) = 0;
};

}  // namespace scan
