// CT volumes of bodies given by a signed distance, with partial-volume edges.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>

#include "drivers/base/rng.h"
#include "reconstruction/volume/volume.h"

namespace scan {

struct SolidVolume {
  std::array<std::size_t, 3> size{48, 48, 48};
  Eigen::Vector3d spacing_mm{0.5, 0.5, 0.5};
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();
  double air = 10, blur_mm = 0.4;  // width of the edge, linear from -blur / 2 to blur / 2
  double noise = 0;                // standard deviation, about uniform
};

// `distance` in mm, negative inside; `grey(distance, point)` is the material's grey value. The
// volume is centred on the origin of the model frame.
inline Volume MakeSolidVolume(const SolidVolume& shape,
                              const std::function<double(const Eigen::Vector3d&)>& distance,
                              const std::function<double(double)>& grey) {
  Volume volume;
  volume.size = shape.size;
  volume.spacing_mm = shape.spacing_mm;
  volume.direction = shape.direction;
  const Eigen::Matrix3d model_from_index = shape.direction * shape.spacing_mm.asDiagonal();
  const Eigen::Vector3d middle(0.5 * (static_cast<double>(shape.size[0]) - 1),
                               0.5 * (static_cast<double>(shape.size[1]) - 1),
                               0.5 * (static_cast<double>(shape.size[2]) - 1));
  volume.origin_mm = -model_from_index * middle;
  Rng rng(1);
  for (std::size_t k = 0; k < shape.size[2]; ++k)
    for (std::size_t j = 0; j < shape.size[1]; ++j)
      for (std::size_t i = 0; i < shape.size[0]; ++i) {
        const Eigen::Vector3d p =
            volume.origin_mm + model_from_index * Eigen::Vector3d(static_cast<double>(i),
                                                                  static_cast<double>(j),
                                                                  static_cast<double>(k));
        const double d = distance(p);
        const double share = std::clamp(0.5 - d / shape.blur_mm, 0.0, 1.0);
        const double noise = shape.noise * std::sqrt(3.0) * rng.Uniform(-1, 1);
        volume.grey.push_back(
            static_cast<float>(shape.air + share * (grey(d) - shape.air) + noise));
      }
  return volume;
}

}  // namespace scan
