// Band-limited solid noise, the same on every platform.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace scan {

// Gradient noise of period 1 (Perlin 2002), about [-1, 1], mean 0, gradient continuous.
double SolidNoise(const Eigen::Vector3d& p, std::uint32_t seed);

// `octaves` of it, each of half the wavelength and `gain` times the amplitude; scaled to stay
// within about [-1, 1].
double FractalNoise(Eigen::Vector3d p, int octaves, double gain, std::uint32_t seed);

// Distance from the nearest of the random points, one per unit cell (Worley 1996), and that
// point's own random number in [0, 1).
struct CellPoint {
  double distance;
  double value;
};
CellPoint NearestCellPoint(const Eigen::Vector3d& p, std::uint32_t seed);

}  // namespace scan
