// Radial distortion as one number that is alike for all lenses.
#pragma once

#include "drivers/base/intrinsics.h"

namespace scan {

// k1 that moves the picture's corner by its own distance from the middle: a change of the
// distortion by d, relative to that distance, changes k1 by d times this.
inline double K1OfCorner(const Intrinsics& in) {
  const double x = 0.5 * in.w / in.fl_x, y = 0.5 * in.h / in.fl_y;
  return 1 / (x * x + y * y);
}

}  // namespace scan
