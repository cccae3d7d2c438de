// How a long stage tells its caller how far it is.
#pragma once

#include <functional>
#include <string_view>

namespace scan {

// Called with the stage's name and the share done in [0, 1]; from one thread at a time.
using ProgressFn = std::function<void(std::string_view stage, double done)>;

inline void Report(const ProgressFn& progress, std::string_view stage, double done) {
  if (progress) progress(stage, done);
}

}  // namespace scan
