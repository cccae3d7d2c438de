// The CT volume that a scanner would make of a synthetic specimen.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "reconstruction/specimens/specimen.h"
#include "reconstruction/volume/volume.h"

namespace scan {

struct CtOptions {
  double voxel_mm = 0;  // edge of the cubic voxels; 0: the longest side gets `longest_side` voxels
  int longest_side = 256;  // voxels
  double margin_mm = 1.2;  // air around the specimen
  double air_grey = 9000,
         dense_grey = 50000;      // grey of density 0 and 1; values are whole, 0..65535
  double noise_sigma_grey = 700;  // white, Gaussian
  double blur_voxels = 0.6;       // standard deviation of the point spread
  int supersampling = 3;          // samples along a voxel that the surface crosses
  double ring_grey = 0;           // amplitude of rings around the middle of the slices (i, j)
  double beam_hardening = 0;      // share by which material 5 mm below the surface is too dark
  std::uint64_t seed = 1;
  // Columns: the directions of i, j, k in the model frame (a rotation).
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();
};

// Grey at half way between air and shell lies on the specimen's surface. The specimen keeps its
// place in the model frame whatever `direction` is. Same bytes for any number of threads.
// Preconditions: voxel_mm >= 0, longest_side >= 8, supersampling >= 1.
Volume SynthesiseCt(const Specimen& specimen, const CtOptions& options = {});

}  // namespace scan
