// Nominal camera geometry: what the station's description says, before any error.
#pragma once

#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "drivers/station/station_config.h"

namespace scan {

using CameraFromStation = Transform<frame::Camera, frame::Station>;

// A camera that looks at a point of the turntable axis (`look_at_mm` above the platter) from
// `distance_mm`, at the azimuth about the axis (from station +x) and the elevation above the
// horizontal; its image x axis is horizontal. Precondition: |elevation| < 90 degrees.
CameraFromStation LookAtAxis(double distance_mm, double elevation_rad, double azimuth_rad,
                             double look_at_mm);

// camera_from_lift * lift_from_station * station_from_table.
CameraFromTable NominalCameraFromTable(const CameraFromLift& camera_from_lift, double lift_mm,
                                       const Eigen::Vector3d& lift_direction_in_station,
                                       double turntable_rad);

// camera_from_lift of one aim, such that the camera looks at the aim's point when the lift stands
// at the aim's height.
CameraFromLift NominalCameraFromLift(const StationConfig& station, const CameraConfig& camera,
                                     const AimConfig& aim);

// Pixels from the lens and the sensor, the principal point in the middle of the picture.
Intrinsics NominalIntrinsics(const CameraConfig& camera);

Eigen::Vector3d LiftDirection(const StationConfig& station);

// Rotation by `yaw` about the model's z axis, then the tilt, about the pivot, which comes to stand
// at the offset.
TableFromModel MakeTableFromModel(const PlacementConfig& placement);

}  // namespace scan
