// The devices that a daemon captures with, whichever they are.
#pragma once

#include <optional>

#include "acquisition/plan/framing.h"
#include "acquisition/runner/runner.h"
#include "drivers/station/station.h"

namespace scan {

class StationHost {
 public:
  virtual ~StationHost() = default;
  virtual Station& station() = 0;
  // Of every capture that asks for background plates.
  virtual SpecimenPrompt prompt() = 0;
  // What must stay in the picture; none where nobody knows it.
  virtual std::optional<BoundingCylinder> specimen_bounds() const = 0;
};

}  // namespace scan
