// Seeded local random numbers with the same sequence on every platform.
#pragma once

#include <cmath>
#include <cstdint>

#include "drivers/base/units.h"

namespace scan {

// SplitMix64 (Steele, Lea, Flood 2014): small state, passes BigCrush, easy to seed per item.
class Rng {
 public:
  explicit Rng(std::uint64_t seed) : state_(seed) {}

  std::uint64_t Next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }
  // [0, 1)
  double Uniform() { return static_cast<double>(Next() >> 11) * 0x1.0p-53; }
  double Uniform(double low, double high) { return low + (high - low) * Uniform(); }
  // 0 .. count - 1
  std::uint64_t Below(std::uint64_t count) {
    return static_cast<std::uint64_t>(Uniform() * static_cast<double>(count));
  }
  // Mean 0, standard deviation 1 (Box-Muller).
  double Normal() {
    const double u = 1.0 - Uniform();
    return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * kPi * Uniform());
  }

 private:
  std::uint64_t state_;
};

}  // namespace scan
