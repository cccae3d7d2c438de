// Poses with every field set.
#pragma once

#include <limits>

#include "reconstruction/pose/poses.h"

namespace scan {

inline CameraFromModel SamplePose(double angle) {
  return CameraFromModel(
      Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix(),
      Eigen::Vector3d(1.5, -2.25, 550 + angle));
}

inline Poses SamplePoses() {
  Poses poses;
  poses.model = "surface.ply";
  LensEstimate lens;
  lens.intrinsics = {16, 12, 47.4, 47.5, 8.1, 5.9, 0.01, -0.02, 0.001, 0.002, 0};
  lens.parameters = {{"fl_rel", {1.0001, 0.0005, 0.01}},
                     {"cx", {8.1, 0.2, std::numeric_limits<double>::infinity()}}};
  poses.lens_states["c0-a0"] = lens;
  poses.nuisances["mask_bias_px"] = {0.31, 0.05, 1};
  poses.mountings.push_back({"m0", TableFromModel(SamplePose(0.2).isometry())});
  poses.axis_in_camera["a0"] = {Eigen::Vector3d(0, -0.6, 0.8), Eigen::Vector3d(0.1, 5, 550)};
  FreeDirection direction;
  direction.of = "m0";
  direction.axis = Eigen::Vector3d(0.6, 0, 0.8);
  direction.data_sigma = std::numeric_limits<double>::infinity();
  direction.held_by = "turntable log";
  poses.free_directions.push_back(direction);
  for (int i = 0; i < 2; ++i) {
    ViewPose view;
    view.name = i == 0 ? "v000" : "v001";
    view.lens_state = "c0-a0";
    view.mounting = "m0";
    view.aim = "a0";
    view.status = i == 0 ? ViewStatus::accepted : ViewStatus::rejected;
    view.reason = i == 0 ? "" : "the contour leaves the picture";
    view.camera_from_model = SamplePose(0.1 + i);
    view.cost_px = 0.25 + i;
    view.cost_l1_px = 1.0 / 3;
    view.contour_rms_px = i == 0 ? 0.7 : std::numeric_limits<double>::infinity();
    view.covariance = Matrix6d::Identity() * 1e-6;
    view.covariance(0, 5) = view.covariance(5, 0) = 1e-9;
    view.surface_sigma_px = {0.1, 0.3};
    view.alternatives.push_back({SamplePose(2), 1.5});
    poses.views.push_back(view);
  }
  poses.notes = {"The azimuth rests on the turntable log."};
  return poses;
}

}  // namespace scan
