#include "reconstruction/specimens/solid_noise.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace scan {
namespace {

std::uint32_t Hash(int x, int y, int z, std::uint32_t seed) {
  std::uint32_t h = seed * 0x9e3779b9u;
  h ^= static_cast<std::uint32_t>(x) * 0x85ebca6bu;
  h = (h ^ (h >> 15)) * 0x2c1b3c6du;
  h ^= static_cast<std::uint32_t>(y) * 0xc2b2ae35u;
  h = (h ^ (h >> 12)) * 0x297a2d39u;
  h ^= static_cast<std::uint32_t>(z) * 0x27d4eb2fu;
  h = (h ^ (h >> 15)) * 0x85ebca6bu;
  return h ^ (h >> 13);
}

// One of the 12 edge directions of a cube.
double Gradient(std::uint32_t hash, double x, double y, double z) {
  const std::uint32_t h = hash & 15;
  const double u = h < 8 ? x : y;
  const double v = h < 4 ? y : (h == 12 || h == 14 ? x : z);
  return ((h & 1) ? -u : u) + ((h & 2) ? -v : v);
}

double Fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }

int Floor(double v) {
  const int i = static_cast<int>(v);
  return i - (i > v);
}

}  // namespace

double SolidNoise(const Eigen::Vector3d& p, std::uint32_t seed) {
  const int ix = Floor(p.x()), iy = Floor(p.y()), iz = Floor(p.z());
  const double x = p.x() - ix, y = p.y() - iy, z = p.z() - iz;
  const double u = Fade(x), v = Fade(y), w = Fade(z);
  std::array<double, 8> g;
  for (int k = 0; k < 8; ++k) {
    const int dx = k & 1, dy = (k >> 1) & 1, dz = k >> 2;
    g[static_cast<std::size_t>(k)] =
        Gradient(Hash(ix + dx, iy + dy, iz + dz, seed), x - dx, y - dy, z - dz);
  }
  const auto mix = [](double a, double b, double t) { return a + t * (b - a); };
  return mix(mix(mix(g[0], g[1], u), mix(g[2], g[3], u), v),
             mix(mix(g[4], g[5], u), mix(g[6], g[7], u), v), w);
}

double FractalNoise(Eigen::Vector3d p, int octaves, double gain, std::uint32_t seed) {
  double sum = 0, amplitude = 1, total = 0;
  for (int k = 0; k < octaves; ++k) {
    sum += amplitude * SolidNoise(p, seed + static_cast<std::uint32_t>(k));
    total += amplitude * amplitude;
    amplitude *= gain;
    p = 2 * p + Eigen::Vector3d::Constant(17.3);
  }
  return std::clamp(1.4 * sum / std::sqrt(total), -1.0, 1.0);
}

CellPoint NearestCellPoint(const Eigen::Vector3d& p, std::uint32_t seed) {
  const int ix = Floor(p.x()), iy = Floor(p.y()), iz = Floor(p.z());
  double nearest2 = 1e9;
  std::uint32_t nearest = 0;
  for (int z = iz - 1; z <= iz + 1; ++z) {
    for (int y = iy - 1; y <= iy + 1; ++y) {
      for (int x = ix - 1; x <= ix + 1; ++x) {
        const std::uint32_t h = Hash(x, y, z, seed);
        const Eigen::Vector3d point(x + (h & 1023) / 1024.0, y + ((h >> 10) & 1023) / 1024.0,
                                    z + ((h >> 20) & 1023) / 1024.0);
        const double d2 = (point - p).squaredNorm();
        if (d2 < nearest2) {
          nearest2 = d2;
          nearest = h;
        }
      }
    }
  }
  return {std::sqrt(nearest2), (nearest * 0x9e3779b1u >> 8) / 16777216.0};
}

}  // namespace scan
