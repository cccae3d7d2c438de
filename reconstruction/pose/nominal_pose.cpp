#include "reconstruction/pose/nominal_pose.h"

namespace scan {

std::optional<CameraFromTable> NominalCameraFromTable(const PhotoSet& photos, const Photo& photo) {
  if (photo.camera_from_table) return photo.camera_from_table;
  const Aim& aim = photos.aims[photo.aim];
  if (!aim.camera_from_lift || !photo.turntable_rad) return std::nullopt;
  const double lift_mm = photo.lift_mm ? photo.lift_mm->nominal : 0.0;
  return *aim.camera_from_lift * MakeLiftFromStation(lift_mm, photos.lift_direction_in_station) *
         MakeStationFromTable(photo.turntable_rad->nominal);
}

}  // namespace scan
