// Rigid transforms whose type carries the frames: target_from_source.
#pragma once

#include <Eigen/Geometry>

namespace scan {

namespace frame {
struct Model {};    // the CT volume's physical frame
struct Table {};    // turns with the platter; origin where its axis meets the platter, +z up
struct Station {};  // fixed; equals Table at turntable angle 0
struct Lift {};     // moves with the camera carriage
struct Camera {};   // OpenCV axes: x right, y down, z forward
}  // namespace frame

// x_target = target_from_source * x_source; lengths in mm. Only matching frames compose.
template <class Target, class Source>
class Transform {
 public:
  Transform() : isometry_(Eigen::Isometry3d::Identity()) {}
  explicit Transform(const Eigen::Isometry3d& isometry) : isometry_(isometry) {}
  Transform(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation_mm)
      : isometry_(Eigen::Isometry3d::Identity()) {
    isometry_.linear() = rotation;
    isometry_.translation() = translation_mm;
  }

  const Eigen::Isometry3d& isometry() const { return isometry_; }
  Eigen::Matrix3d rotation() const { return isometry_.linear(); }
  Eigen::Vector3d translation() const { return isometry_.translation(); }
  Eigen::Matrix<double, 3, 4> matrix34() const { return isometry_.matrix().template topRows<3>(); }

  Transform<Source, Target> inverse() const {
    return Transform<Source, Target>(isometry_.inverse(Eigen::Isometry));
  }
  template <class Inner>
  Transform<Target, Inner> operator*(const Transform<Source, Inner>& other) const {
    return Transform<Target, Inner>(isometry_ * other.isometry());
  }
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return isometry_ * point; }

 private:
  Eigen::Isometry3d isometry_;
};

using CameraFromModel = Transform<frame::Camera, frame::Model>;
using CameraFromTable = Transform<frame::Camera, frame::Table>;
using CameraFromLift = Transform<frame::Camera, frame::Lift>;
using LiftFromStation = Transform<frame::Lift, frame::Station>;
using StationFromTable = Transform<frame::Station, frame::Table>;
using TableFromModel = Transform<frame::Table, frame::Model>;

// Rz(+angle): positive turns the platter counter-clockwise seen from above.
inline StationFromTable MakeStationFromTable(double turntable_rad) {
  return StationFromTable(
      Eigen::AngleAxisd(turntable_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
      Eigen::Vector3d::Zero());
}

// Translates by -lift_mm along the lift's direction in the station frame.
inline LiftFromStation MakeLiftFromStation(double lift_mm,
                                           const Eigen::Vector3d& direction_in_station) {
  return LiftFromStation(Eigen::Matrix3d::Identity(), -lift_mm * direction_in_station);
}

// The camera's centre in the source frame.
template <class Source>
Eigen::Vector3d CameraCentre(const Transform<frame::Camera, Source>& camera_from_source) {
  return camera_from_source.inverse().translation();
}

}  // namespace scan
