#include "acquisition/plan/station_plan.h"

#include "acquisition/plan/ring_plan.h"
#include "drivers/station/geometry.h"

namespace scan {
namespace {

AxisDocument Describe(const AxisConfig& config) {
  AxisDocument axis;
  axis.unit = config.unit;
  axis.steps_per_unit = config.steps_per_unit;
  axis.sign = config.sign;
  axis.min = config.min;
  axis.max = config.max;
  axis.backlash = config.backlash;
  axis.on_stop = config.on_stop;
  return axis;
}

LiftKind LiftKindOf(const std::string& word) {
  if (word == "manual_aim") return LiftKind::manual_aim;
  if (word == "arc") return LiftKind::arc;
  if (word == "pitch_axis") return LiftKind::pitch_axis;
  return LiftKind::fixed_pitch;
}

CameraDocument Describe(const StationConfig& station, const CameraConfig& config) {
  CameraDocument camera;
  camera.id = config.id;
  camera.intrinsics = NominalIntrinsics(config);
  camera.sigma = {config.sigma_fl_rel, config.sigma_c_px};
  camera.camera_from_lift_sigma = {config.sigma_rotation_deg, config.sigma_translation_mm};
  for (const AimConfig& aim : station.aims)
    camera.camera_from_lift[aim.id] = NominalCameraFromLift(station, config, aim);
  return camera;
}

}  // namespace

StationDocument DescribeStation(const StationConfig& config) {
  StationDocument station;
  station.turntable = Describe(config.turntable);
  station.lift_axis = Describe(config.lift);
  station.lift.kind = LiftKindOf(config.lift_geometry.kind);
  station.lift.direction_in_station = LiftDirection(config);
  for (const CameraConfig& camera : config.cameras)
    station.cameras.push_back(Describe(config, camera));
  return station;
}

Result<std::vector<PlannedView>> PlanOfStation(const StationConfig& config) {
  std::vector<Ring> rings;
  for (const RingConfig& planned : config.plan.rings) {
    const AimConfig* aim = FindAim(config, planned.aim);
    if (!aim)
      return BadInput("unknown aim '" + planned.aim + "'", "plan.rings", "name one of the aims");
    Ring ring;
    ring.aim_id = planned.aim;
    ring.lift_mm = aim->lift_mm;
    ring.count = planned.count;
    ring.start_deg = planned.start_deg;
    ring.cameras.clear();
    for (const CameraConfig& camera : config.cameras) ring.cameras.push_back(camera.id);
    rings.push_back(std::move(ring));
  }
  SCAN_TRY(std::vector<PlannedView> views, PlanRings(rings));
  for (PlannedView& view : views)
    if (const CameraConfig* camera = FindCamera(config, view.camera))
      view.exposure_us = camera->exposure_us;
  return views;
}

}  // namespace scan
