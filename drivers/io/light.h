// The station's lamp.
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
