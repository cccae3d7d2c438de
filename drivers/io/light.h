// The station's lamp as a capture sees it: on or off. Which Lamp (lamp.h) gives it, how bright "on"
// is and how long it settles are the station file's.
#pragma once

#include "drivers/base/result.h"

namespace scan {

// Thread contract: any thread. Errors: device faults.
class Light {
 public:
  virtual ~Light() = default;
  virtual Status Set(bool on) = 0;
};

}  // namespace scan
