#include "drivers/station/geometry.h"

#include <cmath>

#include "drivers/base/units.h"

namespace scan {

CameraFromStation LookAtAxis(double distance_mm, double elevation_rad, double azimuth_rad,
                             double look_at_mm) {
  const Eigen::Vector3d towards_camera(std::cos(elevation_rad) * std::cos(azimuth_rad),
                                       std::cos(elevation_rad) * std::sin(azimuth_rad),
                                       std::sin(elevation_rad));
  const Eigen::Vector3d centre = Eigen::Vector3d(0, 0, look_at_mm) + distance_mm * towards_camera;
  const Eigen::Vector3d z = -towards_camera;
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  return CameraFromStation(rotation, -rotation * centre);
}

CameraFromTable NominalCameraFromTable(const CameraFromLift& camera_from_lift, double lift_mm,
                                       const Eigen::Vector3d& lift_direction_in_station,
                                       double turntable_rad) {
  return camera_from_lift * MakeLiftFromStation(lift_mm, lift_direction_in_station) *
         MakeStationFromTable(turntable_rad);
}

CameraFromLift NominalCameraFromLift(const StationConfig& station, const CameraConfig& camera,
                                     const AimConfig& aim) {
  return LookAtAxis(aim.distance_mm, RadFromDeg(aim.elevation_deg), RadFromDeg(camera.azimuth_deg),
                    aim.look_at_mm) *
         MakeLiftFromStation(aim.lift_mm, LiftDirection(station)).inverse();
}

Intrinsics NominalIntrinsics(const CameraConfig& camera) {
  const double fl = camera.lens.focal_mm / camera.lens.sensor_width_mm * camera.w;
  return {.w = camera.w,
          .h = camera.h,
          .fl_x = fl,
          .fl_y = fl,
          .cx = camera.w / 2.0,
          .cy = camera.h / 2.0,
          .k1 = camera.lens.k1,
          .k2 = camera.lens.k2,
          .p1 = camera.lens.p1,
          .p2 = camera.lens.p2,
          .k3 = camera.lens.k3};
}

Eigen::Vector3d LiftDirection(const StationConfig& station) {
  const auto& d = station.lift_geometry.direction_in_station;
  return Eigen::Vector3d(d[0], d[1], d[2]).normalized();
}

TableFromModel MakeTableFromModel(const PlacementConfig& placement) {
  const double axis = RadFromDeg(placement.tilt_axis_deg);
  const Eigen::Matrix3d rotation =
      (Eigen::AngleAxisd(RadFromDeg(placement.tilt_deg),
                         Eigen::Vector3d(std::cos(axis), std::sin(axis), 0)) *
       Eigen::AngleAxisd(RadFromDeg(placement.yaw_deg), Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  const Eigen::Vector3d offset(placement.offset_mm.data());
  const Eigen::Vector3d pivot(placement.pivot_in_model_mm.data());
  return TableFromModel(rotation, offset - rotation * pivot);
}

}  // namespace scan
