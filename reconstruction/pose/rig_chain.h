// The chain of rig_model.h for any scalar: doubles to evaluate, jets to differentiate.
#pragma once

#include <ceres/rotation.h>

#include <Eigen/Core>

#include "reconstruction/pose/rig_model.h"

namespace scan {

template <class T>
struct RigidOf {
  Eigen::Matrix<T, 3, 3> rotation;
  Eigen::Matrix<T, 3, 1> translation;
};

template <class T>
Eigen::Matrix<T, 3, 3> ExpOf(const T* w) {
  Eigen::Matrix<T, 3, 3> rotation;
  ceres::AngleAxisToRotationMatrix(w, rotation.data());  // column major, as Eigen's default
  return rotation;
}

// after := (x -> Exp(w) x + rho) . before
template <class T>
RigidOf<T> Deviated(const T* w_rho, const RigidOf<T>& before) {
  const Eigen::Matrix<T, 3, 3> turn = ExpOf(w_rho);
  return {turn * before.rotation,
          turn * before.translation + Eigen::Map<const Eigen::Matrix<T, 3, 1>>(w_rho + 3)};
}

template <class T>
RigidOf<T> TableFromModelChain(const TableFromModel& start, const T* mounting) {
  return Deviated<T>(mounting, {start.rotation().cast<T>(), start.translation().cast<T>()});
}

// Maps a rigid x_table = R x + t on to the camera; `own` is the view's own deviation.
template <class T>
RigidOf<T> CameraChain(const RigView& view, const RigidOf<T>& table, const T& epoch, const T* aim,
                       const T* axis, const T* own) {
  RigidOf<T> x = table;
  if (view.turns) {
    const T about_z[3] = {T(0), T(0), T(view.turntable_rad) + epoch + own[0]};
    const T tilt[3] = {axis[0], axis[1], T(0)};
    const Eigen::Matrix<T, 3, 3> turn = ExpOf(tilt) * ExpOf(about_z);
    x = {turn * x.rotation, turn * x.translation};
    x.translation(0) += axis[2];
    x.translation(1) += axis[3];
  }
  x.translation -= own[1] * view.lift_direction.cast<T>();
  const Eigen::Matrix<T, 3, 3> rotation = view.camera_from_station.rotation().cast<T>();
  const Eigen::Matrix<T, 3, 1> translation = view.camera_from_station.translation().cast<T>();
  x = {rotation * x.rotation, rotation * x.translation + translation};
  return Deviated(own + 2, Deviated(aim, x));
}

// camera_from_model in the mesh's own mm: x_camera / s = R x + t / s.
template <class T>
RigidOf<T> CameraFromModelChain(const RigView& view, const TableFromModel& start, const T* mounting,
                                const T& epoch, const T* aim, const T* axis, const T* own,
                                const T& log_ct_scale) {
  using std::exp;
  RigidOf<T> x = CameraChain(view, TableFromModelChain(start, mounting), epoch, aim, axis, own);
  x.translation *= exp(-log_ct_scale);
  return x;
}

}  // namespace scan
