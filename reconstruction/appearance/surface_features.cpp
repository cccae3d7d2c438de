#include "reconstruction/appearance/surface_features.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "drivers/base/units.h"

namespace scan {
namespace {

using Eigen::Vector3d;

// Grey between the voxels' centres, trilinear; nothing outside.
class GreyAt {
 public:
  explicit GreyAt(const Volume& volume)
      : volume_(volume),
        index_from_mm_((volume.direction * volume.spacing_mm.asDiagonal()).inverse()) {}

  std::optional<double> operator()(const Vector3d& p) const {
    const Vector3d at = index_from_mm_ * (p - volume_.origin_mm);
    std::array<std::size_t, 3> low{};
    std::array<double, 3> t{};
    for (int k = 0; k < 3; ++k) {
      if (!(at[k] >= 0 && at[k] < static_cast<double>(volume_.size[k]) - 1)) return {};
      low[k] = static_cast<std::size_t>(at[k]);
      t[k] = at[k] - static_cast<double>(low[k]);
    }
    double grey = 0;
    for (std::size_t corner = 0; corner < 8; ++corner) {
      const std::size_t x = corner & 1, y = corner >> 1 & 1, z = corner >> 2;
      grey += (x ? t[0] : 1 - t[0]) * (y ? t[1] : 1 - t[1]) * (z ? t[2] : 1 - t[2]) *
              static_cast<double>(volume_.grey[volume_.index(low[0] + x, low[1] + y, low[2] + z)]);
    }
    return grey;
  }

 private:
  const Volume& volume_;
  Eigen::Matrix3d index_from_mm_;
};

RingMap DensityLayer(const TurningGrid& grid, const GreyAt& grey_at, double from_mm, double to_mm,
                     int samples) {
  RingMap map = MakeRingMap(grid);
  tbb::parallel_for(std::size_t{0}, grid.size(), [&](std::size_t i) {
    if (std::isnan(grid.relief_mm[i])) return;
    double sum = 0;
    for (int k = 0; k < samples; ++k) {
      const double depth = from_mm + (to_mm - from_mm) * (k + 0.5) / samples;
      const auto grey = grey_at(grid.position[i] + (grid.relief_mm[i] - depth) * grid.normal[i]);
      if (!grey) return;
      sum += *grey;
    }
    map.value[i] = static_cast<float>(sum / samples);
    map.weight[i] = 1;
  });
  return map;
}

// Relief less its mean over a wider patch: a bump is positive, a groove negative.
RingMap Curvature(const TurningGrid& grid, double scale_mm) {
  RingMap relief = MakeRingMap(grid);
  for (std::size_t i = 0; i < grid.size(); ++i) {
    if (std::isnan(grid.relief_mm[i])) continue;
    relief.value[i] = static_cast<float>(grid.relief_mm[i]);
    relief.weight[i] = 1;
  }
  RingMap fine = Smoothed(relief, grid, 0.5 * scale_mm);
  const RingMap wide = Smoothed(relief, grid, 1.5 * scale_mm);
  for (std::size_t i = 0; i < grid.size(); ++i) fine.value[i] -= wide.value[i];
  return fine;
}

// Directions about `normal`, as dense as the cosine with it.
std::vector<Vector3d> SkyDirections(const Vector3d& normal, int count) {
  const Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  std::vector<Vector3d> directions;
  for (int i = 0; i < count; ++i) {
    const double sine2 = (i + 0.5) / count, azimuth = i * kPi * (3 - std::sqrt(5.0));
    directions.push_back(std::sqrt(sine2) * (std::cos(azimuth) * u + std::sin(azimuth) * v) +
                         std::sqrt(1 - sine2) * normal);
  }
  return directions;
}

// Changes slowly: found at every kStep-th node and spread over the nodes around.
RingMap AmbientOcclusion(const TurningGrid& grid, const MeshBvh& bvh, double reach_mm) {
  constexpr int kStep = 8, kRings = 4, kRays = 24;
  RingMap map = MakeRingMap(grid);
  const int rings = (grid.rings + kRings - 1) / kRings;
  tbb::parallel_for(0, rings * (grid.azimuths / kStep), [&](int cell) {
    const int j = cell % rings * kRings, k = cell / rings * kStep;
    const auto i = static_cast<std::size_t>(grid.index(j, k));
    if (std::isnan(grid.relief_mm[i])) return;
    const Vector3d origin =
        grid.position[i] + (grid.relief_mm[i] + 1e-3 * reach_mm) * grid.normal[i];
    int hidden = 0;
    for (const Vector3d& direction : SkyDirections(grid.normal[i], kRays)) {
      const auto hit = bvh.FirstHit(origin, direction);
      hidden += hit && hit->distance_mm < reach_mm;
    }
    for (int r = j; r < std::min(j + kRings, grid.rings); ++r) {
      for (int d = 0; d < kStep; ++d) {
        const auto to = static_cast<std::size_t>(
            grid.index(r, (k + d + grid.azimuths - kStep / 2) % grid.azimuths));
        map.value[to] = static_cast<float>(hidden) / kRays;
        map.weight[to] = 1;
      }
    }
  });
  return map;
}

}  // namespace

std::vector<SurfaceFeature> SurfaceFeatures(const TurningGrid& grid, const MeshBvh& bvh,
                                            const Volume* volume, const FeatureOptions& options) {
  std::vector<SurfaceFeature> features;
  if (grid.rings == 0) return features;
  const double radius_mm = *std::max_element(grid.radius_mm.begin(), grid.radius_mm.end());
  if (volume != nullptr) {
    const GreyAt grey_at(*volume);
    for (std::size_t k = 0; k + 1 < options.depths.size(); ++k) {
      const double from_mm = options.depths[k] * radius_mm,
                   to_mm = options.depths[k + 1] * radius_mm;
      features.push_back({fmt::format("density {:.1f} to {:.1f} mm deep", from_mm, to_mm),
                          DensityLayer(grid, grey_at, from_mm, to_mm, options.samples_per_layer)});
    }
  }
  features.push_back({"curvature", Curvature(grid, 0.06 * radius_mm)});
  features.push_back(
      {"ambient occlusion", AmbientOcclusion(grid, bvh, options.occlusion_reach * radius_mm)});
  return features;
}

}  // namespace scan
