// Angles are radians and lengths millimetres inside the code; degrees only at the edges.
#pragma once

#include <numbers>

namespace scan {

constexpr double kPi = std::numbers::pi;
constexpr double RadFromDeg(double deg) { return deg * (kPi / 180.0); }
constexpr double DegFromRad(double rad) { return rad * (180.0 / kPi); }

}  // namespace scan
