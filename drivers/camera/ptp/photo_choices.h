// What the entries of a camera's menus mean as numbers.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/base/result.h"

namespace scan {

// "1/125" "10/13" "30" "0.4" "0.0080s" "1/2.5s" "1 1/3" 0"4 2" (seconds) to microseconds, as marked
// on the camera: the shutter's real times go by powers of two (1/128, 32 s). Nothing for Bulb,
// Time, x 200 and whatever else is no time. Thread contract: pure.
std::optional<double> ExposureUsOf(std::string_view choice);

// "100", "ISO 100". Nothing for Auto, Hi 1.
std::optional<double> IsoOf(std::string_view choice);

// "f/5.6", "F5.6", "5.6".
std::optional<double> FNumberOf(std::string_view choice);

// "75%", "Low" (5 %).
std::optional<double> BatteryPercentOf(std::string_view value);

using ChoiceNumber = std::optional<double> (*)(std::string_view);

// The choice that is nearest by ratio, if it is within `tolerance_rel` of the number asked for.
// `what` and `unit` are for errors ("exposure", "us"). Errors: bad_input naming the neighbours.
Result<std::string> NearestChoice(const std::vector<std::string>& choices, ChoiceNumber number_of,
                                  double asked, double tolerance_rel, std::string_view what,
                                  std::string_view unit);

}  // namespace scan
