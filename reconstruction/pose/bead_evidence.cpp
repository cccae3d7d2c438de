#include "reconstruction/pose/bead_evidence.h"

#include <algorithm>
#include <cassert>

#include "reconstruction/pose/lens_distortion.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan {

Eigen::Vector2d BeadPixel(const ViewState& state, const Eigen::Vector3d& centre, double radius_mm) {
  const Intrinsics& in = state.intrinsics;
  const Eigen::Vector3d x = state.camera_from_model * centre;
  assert(x.z() > radius_mm);
  const double z = x.z() - radius_mm * radius_mm / x.z();
  return Eigen::Vector2d(in.fl_x, in.fl_y).cwiseProduct(Distort(in, x.head<2>() / z)) +
         Eigen::Vector2d(in.cx, in.cy);
}

Eigen::Vector2d BeadResidual(const ViewState& state, const BeadSighting& sighting,
                             const Eigen::Vector3d& pivot, BeadDerivative* dr) {
  const Eigen::Vector2d pixel = BeadPixel(state, sighting.centre, sighting.radius_mm);
  if (dr) {
    const Intrinsics& in = state.intrinsics;
    const Eigen::Vector3d x = state.camera_from_model * sighting.centre;
    const double shrink = sighting.radius_mm * sighting.radius_mm / x.z();
    const double inverse_z = 1 / (x.z() - shrink), dz = 1 + shrink / x.z();
    Eigen::Matrix2d ddistorted_dnormalised;
    Distort(in, x.head<2>() * inverse_z, &ddistorted_dnormalised);
    Eigen::Matrix<double, 2, 3> dnormalised_dx;
    dnormalised_dx << inverse_z, 0, -x.x() * inverse_z * inverse_z * dz,  //
        0, inverse_z, -x.y() * inverse_z * inverse_z * dz;
    const Eigen::Vector2d minus_focal(-in.fl_x, -in.fl_y);
    const Eigen::Matrix<double, 2, 3> dr_dx =
        minus_focal.asDiagonal() * ddistorted_dnormalised * dnormalised_dx;
    dr->leftCols<3>() = -dr_dx * Skew(x - pivot);
    dr->middleCols<3>(3) = dr_dx;
    dr->col(6) = -(pixel - Eigen::Vector2d(in.cx, in.cy));
    dr->middleCols<2>(7) = -Eigen::Matrix2d::Identity();
    dr->col(9).setZero();
    const Eigen::Vector2d normalised = x.head<2>() * inverse_z;
    dr->col(10) = K1OfCorner(in) * normalised.squaredNorm() * minus_focal.cwiseProduct(normalised);
  }
  return sighting.target - pixel;
}

void AddBeads(std::span<const BeadSighting> sightings, CondensedEvidence& evidence) {
  constexpr double kHuberSigmas = 3;
  for (const BeadSighting& sighting : sightings) {
    if ((evidence.state.camera_from_model * sighting.centre).z() <= 2 * sighting.radius_mm)
      continue;
    BeadDerivative dr;
    const Eigen::Vector2d r = BeadResidual(evidence.state, sighting, evidence.pivot, &dr);
    const double sigmas = r.norm() / sighting.sigma_px;
    const double weight = std::min(1.0, kHuberSigmas / std::max(sigmas, 1e-12)) /
                          (sighting.sigma_px * sighting.sigma_px);
    evidence.H += weight * dr.transpose() * dr;
    evidence.g += weight * dr.transpose() * r;
  }
}

}  // namespace scan
