// Named positions of the camera's pitch axis.
#pragma once

#include <string>
#include <vector>

#include "drivers/base/result.h"

namespace scan {

// Thread contract: one thread at a time. Errors: device faults.
class AimPreset {
 public:
  virtual ~AimPreset() = default;
  virtual std::vector<std::string> Ids() const = 0;
  virtual std::string Current() const = 0;
  // Precondition: `id` is one of Ids().
  virtual Status GoTo(const std::string& id) = 0;
};

}  // namespace scan
