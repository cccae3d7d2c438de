#include "reconstruction/appearance/ring_map.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace scan {
namespace {

std::vector<float> HalfGaussian(double sigma) {
  std::vector<float> kernel{1};
  for (int i = 1; i <= static_cast<int>(std::ceil(3 * sigma)); ++i)
    kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma))));
  return kernel;
}

int Around(int azimuth, int azimuths) {
  azimuth %= azimuths;
  return azimuth < 0 ? azimuth + azimuths : azimuth;
}

}  // namespace

RingMap MakeRingMap(const TurningGrid& grid) {
  return {grid.rings, grid.azimuths, std::vector<float>(grid.size(), 0.f),
          std::vector<float>(grid.size(), 0.f)};
}

RingMap Smoothed(const RingMap& map, const TurningGrid& grid, double sigma_mm) {
  assert(map.rings == grid.rings && map.azimuths == grid.azimuths);
  if (!(sigma_mm > 0)) return map;
  RingMap along = map, out = map;  // value: the sum of value * weight until the end
  tbb::parallel_for(0, map.rings, [&](int j) {
    const double cell_mm = grid.radius_mm[static_cast<std::size_t>(j)] * grid.step_rad();
    const auto kernel = HalfGaussian(std::min(sigma_mm / cell_mm, map.azimuths / 8.0));
    const int reach = static_cast<int>(kernel.size()) - 1;
    for (int k = 0; k < map.azimuths; ++k) {
      float sum = 0, weight = 0;
      for (int d = -reach; d <= reach; ++d) {
        const int i = map.index(j, Around(k + d, map.azimuths));
        const float w = kernel[static_cast<std::size_t>(std::abs(d))] * map.weight[i];
        sum += w * map.value[i];
        weight += w;
      }
      along.value[map.index(j, k)] = sum;
      along.weight[map.index(j, k)] = weight;
    }
  });
  const auto kernel = HalfGaussian(sigma_mm / grid.spacing_mm);
  const int reach = static_cast<int>(kernel.size()) - 1;
  tbb::parallel_for(0, map.rings, [&](int j) {
    for (int k = 0; k < map.azimuths; ++k) {
      float sum = 0, weight = 0;
      for (int r = std::max(0, j - reach); r <= std::min(map.rings - 1, j + reach); ++r) {
        const float w = kernel[static_cast<std::size_t>(std::abs(r - j))];
        sum += w * along.value[map.index(r, k)];
        weight += w * along.weight[map.index(r, k)];
      }
      if (map.weight[map.index(j, k)] > 0 && weight > 0) out.value[map.index(j, k)] = sum / weight;
    }
  });
  return out;
}

RingMap Reduced(const RingMap& map, int rings, int azimuths) {
  assert(map.azimuths % azimuths == 0);
  RingMap out;
  out.rings = (map.rings + rings - 1) / rings;
  out.azimuths = map.azimuths / azimuths;
  out.value.assign(static_cast<std::size_t>(out.rings) * out.azimuths, 0.f);
  out.weight = out.value;
  for (int j = 0; j < map.rings; ++j) {
    for (int k = 0; k < map.azimuths; ++k) {
      const int to = out.index(j / rings, k / azimuths), from = map.index(j, k);
      out.value[to] += map.weight[from] * map.value[from];
      out.weight[to] += map.weight[from];
    }
  }
  for (std::size_t i = 0; i < out.size(); ++i)
    if (out.weight[i] > 0) out.value[i] /= out.weight[i];
  return out;
}

void TakeOffRingMeans(RingMap& map) {
  for (int j = 0; j < map.rings; ++j) {
    double sum = 0, weight = 0;
    for (int k = 0; k < map.azimuths; ++k) {
      sum += static_cast<double>(map.weight[map.index(j, k)]) * map.value[map.index(j, k)];
      weight += map.weight[map.index(j, k)];
    }
    if (!(weight > 0)) continue;
    for (int k = 0; k < map.azimuths; ++k)
      map.value[map.index(j, k)] -= static_cast<float>(sum / weight);
  }
}

MapSample SampleRing(const RingMap& map, int ring, double azimuth) {
  const double floor = std::floor(azimuth);
  const int k = Around(static_cast<int>(floor), map.azimuths);
  const int a = map.index(ring, k), b = map.index(ring, Around(k + 1, map.azimuths));
  if (!(map.weight[a] > 0 && map.weight[b] > 0)) return {};
  const auto t = static_cast<float>(azimuth - floor);
  return {(1 - t) * map.value[a] + t * map.value[b], std::min(map.weight[a], map.weight[b]),
          map.value[b] - map.value[a]};
}

}  // namespace scan
