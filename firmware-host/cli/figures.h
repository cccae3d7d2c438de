// Figures that several commands print.
#pragma once

#include <chrono>

#include "firmware-host/cli/command.h"
#include "reconstruction/pose/score.h"

namespace scan {

inline Json ToJson(const Spread& spread) {
  return {{"median", spread.median}, {"p95", spread.p95}, {"max", spread.max}};
}

inline double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace scan
