// Times of a configuration as clocks count them.
#pragma once

#include <cmath>
#include <cstdint>

namespace scan {

// Rounded. Precondition: within about 290 years.
inline std::int64_t NsOfMs(double ms) { return std::llround(ms * 1e6); }

}  // namespace scan
