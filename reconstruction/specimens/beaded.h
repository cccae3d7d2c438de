// Any specimen with beads glued to it.
#pragma once

#include <memory>
#include <vector>

#include "reconstruction/fiducials/bead.h"
#include "reconstruction/specimens/specimen.h"

namespace scan {

struct BeadedOptions {
  double diameter_mm = 1.0;
  double proud = 0;  // height of the centres above the surface, in radii, in (-1, 1)
  // Directions from the middle of the specimen's box in which the beads sit, (longitude, height
  // above the middle relative to half of the box's).
  std::vector<std::pair<double, double>> places{{0.35, 0.1}, {2.3, -0.35}, {4.4, 0.4}};
  Eigen::Vector3d srgb{0, 96, 255};  // 8 bit
  double specimen_density = 0.55;    // factor: beads are of density 1
};

// Where the beads sit: on the specimen's outermost surface in each direction.
std::vector<Bead> BeadPlaces(const Specimen& specimen, const BeadedOptions& options);

// The specimen with these beads; its name gets "+beads". Precondition: a specimen.
std::unique_ptr<Specimen> WithBeads(std::unique_ptr<Specimen> specimen,
                                    const BeadedOptions& options = {});

}  // namespace scan
