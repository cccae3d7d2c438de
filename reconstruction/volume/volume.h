// A CT volume of grey values in ITK's physical space.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

namespace scan {

// Voxel (i, j, k) has its centre at origin_mm + direction * (spacing_mm o (i, j, k)); i runs
// fastest in `grey`. Signed and unsigned integers and floats of a file are all held as float.
struct Volume {
  std::array<std::size_t, 3> size{0, 0, 0};
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Ones();
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();
  std::vector<float> grey;

  std::size_t index(std::size_t i, std::size_t j, std::size_t k) const {
    return i + size[0] * (j + size[1] * k);
  }
  std::size_t voxels() const { return size[0] * size[1] * size[2]; }
};

}  // namespace scan
