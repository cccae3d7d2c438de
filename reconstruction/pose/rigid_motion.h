// Small rigid motions: x_true = Exp(w) x + rho, the project's convention for deviations and
// covariances.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "drivers/base/frames.h"

namespace scan {

using Vector6d = Eigen::Matrix<double, 6, 1>;

inline Eigen::Matrix3d Skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// Rotation matrix of a rotation vector, rad.
inline Eigen::Matrix3d ExpSo3(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  if (angle < 1e-300) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
}

// Rotation vector of a rotation matrix, rad, of length at most pi.
inline Eigen::Vector3d LogSo3(const Eigen::Matrix3d& rotation) {
  const Eigen::Quaterniond q(rotation);
  const double sine = q.vec().norm();
  if (sine < 1e-12) return 2.0 * (q.w() < 0 ? -1.0 : 1.0) * q.vec();
  return 2.0 * std::atan2(q.w() < 0 ? -sine : sine, std::abs(q.w())) / sine * q.vec();
}

// x -> Exp(w) (x - pivot) + pivot + tau, applied after `target_from_source`.
template <class Target, class Source>
Transform<Target, Source> MovedAbout(const Transform<Target, Source>& target_from_source,
                                     const Vector6d& motion, const Eigen::Vector3d& pivot) {
  const Eigen::Matrix3d turn = ExpSo3(motion.head<3>());
  return Transform<Target, Source>(
      turn * target_from_source.rotation(),
      turn * (target_from_source.translation() - pivot) + pivot + motion.tail<3>());
}

// The motion that MovedAbout needs to turn `from` into `to`.
template <class Target, class Source>
Vector6d MotionBetween(const Transform<Target, Source>& from, const Transform<Target, Source>& to,
                       const Eigen::Vector3d& pivot) {
  Vector6d motion;
  const Eigen::Matrix3d turn = to.rotation() * from.rotation().transpose();
  motion.head<3>() = LogSo3(turn);
  motion.tail<3>() = to.translation() - pivot - turn * (from.translation() - pivot);
  return motion;
}

// Rotation angle between two rotations, rad.
inline double AngleBetween(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return LogSo3(a.transpose() * b).norm();
}

}  // namespace scan
