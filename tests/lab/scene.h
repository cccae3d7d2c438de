// What stands before the lab's camera: of the pictures that lab_pictures made the one for where the
// motors have come to, else one that no capture may keep (a plain magenta).
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "drivers/base/result.h"

namespace scan {

// Positions of turntable and lift, in steps from their switches.
using WhereFn = std::function<Result<std::pair<std::int64_t, std::int64_t>>()>;

struct Scene {
  using Place = std::tuple<std::int64_t, std::int64_t, bool>;  // turntable, lift, specimen there
  std::map<Place, std::vector<std::byte>> pictures;
  std::vector<std::byte> elsewhere;
  WhereFn where;

  // The picture for where the motors stand now; null when that is not known.
  const std::vector<std::byte>* Seen() const;
};

// Words of a command line: PICTURES STATE TURNTABLE LIFT (motors on GPIO lines, from these
// positions; what they have come to is written to STATE with every picture) or PICTURES
// TURNTABLE_PLACE LIFT_PLACE (files of two lab_tic boards). From then on SIGUSR1 takes the specimen
// off the platter and SIGUSR2 puts it back.
Result<Scene> MakeScene(std::span<char* const> words);

}  // namespace scan
