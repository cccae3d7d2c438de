// Beads glued to specimen or holder: small balls that X-rays and camera both see.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace scan {

// As the CT shows it: model frame, mm.
struct Bead {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius_mm = 0;
  double sigma_mm = 0;     // of each component of the centre
  double residual_mm = 0;  // RMS of the ball's boundary about the sphere
};

// A patch of the beads' colour in a photograph, as far as it is seen: what hides a part of a bead
// moves the centre.
struct BeadImage {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  // centroid, px, first pixel's centre (.5, .5)
  double area_px = 0;                                // square pixels, by coverage
  Eigen::Vector2d semi_axes_px = Eigen::Vector2d::Zero();  // of the ellipse of these moments
  bool cut = false;                                        // by the picture's border
};

// Of one session: the beads, and what each photograph shows, in the order of the photographs.
struct BeadFindings {
  std::vector<Bead> beads;
  std::vector<std::vector<BeadImage>> images;
};

}  // namespace scan
