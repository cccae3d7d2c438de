#include "acquisition/plan/framing.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "drivers/base/units.h"

namespace scan {
namespace {

// Points on the surface: the silhouette of the cylinder is spanned by its two rims; the heights
// between them matter only because a lens may bend the straight edges outwards.
constexpr int kHeights = 5;
constexpr int kAround = 360;

struct Excess {
  double px = -1e300;
  double mm = 0;
  const char* border = "";
  bool behind = false;
};

void Widen(Excess& worst, double px, double mm_per_px, const char* border) {
  if (px > worst.px) worst = {px, px * mm_per_px, border, false};
}

Excess ExcessOfView(const Intrinsics& k, const CameraFromTable& camera_from_table,
                    const BoundingCylinder& cylinder, double margin_px) {
  Excess worst;
  for (int h = 0; h < kHeights; ++h) {
    const double share = static_cast<double>(h) / (kHeights - 1);
    const double z = cylinder.z_low_mm + share * (cylinder.z_high_mm - cylinder.z_low_mm);
    for (int i = 0; i < kAround; ++i) {
      const double angle = 2 * kPi * i / kAround;
      const Eigen::Vector3d in_camera =
          camera_from_table * Eigen::Vector3d(cylinder.radius_mm * std::cos(angle),
                                              cylinder.radius_mm * std::sin(angle), z);
      const auto pixel = Project(k, in_camera);
      if (!pixel) return {1e300, 0, "", true};
      Widen(worst, margin_px - pixel->x(), in_camera.z() / k.fl_x, "left");
      Widen(worst, pixel->x() - (k.w - margin_px), in_camera.z() / k.fl_x, "right");
      Widen(worst, margin_px - pixel->y(), in_camera.z() / k.fl_y, "upper");
      Widen(worst, pixel->y() - (k.h - margin_px), in_camera.z() / k.fl_y, "lower");
    }
  }
  return worst;
}

Status CheckCylinder(const BoundingCylinder& c, double margin_px) {
  const bool finite = std::isfinite(c.radius_mm) && std::isfinite(c.z_low_mm) &&
                      std::isfinite(c.z_high_mm) && std::isfinite(margin_px);
  if (!finite || c.radius_mm <= 0 || c.z_high_mm <= c.z_low_mm || margin_px < 0)
    return BadInput(fmt::format("the specimen's bounding cylinder (radius {} mm, z {} to {} mm, "
                                "margin {} px) is none",
                                c.radius_mm, c.z_low_mm, c.z_high_mm, margin_px),
                    "framing check", "give a radius above 0, z_low below z_high, a margin >= 0");
  return {};
}

Error FramingError(const PlannedView& view, const Excess& worst, double margin_px,
                   std::size_t others) {
  const std::string where =
      fmt::format("view {} (camera {}, aim {}, turntable {:g} deg, lift {:g} mm)", view.id,
                  view.camera, view.aim_id, view.turntable_deg, view.lift_mm);
  const std::string more = others == 0 ? "" : fmt::format(", as do {} other views", others);
  if (worst.behind)
    return {ErrorKind::bad_input,
            "the specimen's bounding cylinder reaches behind the camera or far off its axis" + more,
            where, "correct camera_from_lift of this aim, or the specimen's radius and height"};
  return {ErrorKind::bad_input,
          fmt::format("the specimen's bounding cylinder passes the {} border by {:.0f} px "
                      "({:.2f} mm at the specimen, margin {:g} px){}",
                      worst.border, std::ceil(worst.px), worst.mm, margin_px, more),
          where,
          "re-aim the camera at this lift height (a new aim_id or a pitch preset), change lift_mm, "
          "move the camera back, or give a smaller specimen or margin"};
}

const CameraDocument* FindCamera(const StationDocument& station, const std::string& id) {
  for (const CameraDocument& camera : station.cameras)
    if (camera.id == id) return &camera;
  return nullptr;
}

}  // namespace

Result<CameraFromTable> NominalPose(const StationDocument& station, const std::string& camera,
                                    const std::string& aim_id, double turntable_deg,
                                    double lift_mm) {
  const CameraDocument* found = FindCamera(station, camera);
  if (!found)
    return BadInput("the station has no camera '" + camera + "'", "plan",
                    "name a camera of the station file");
  const auto aim = found->camera_from_lift.find(aim_id);
  if (aim == found->camera_from_lift.end() || !aim->second)
    return BadInput("aim '" + aim_id + "' has no nominal pose", "camera " + camera,
                    "give its camera_from_lift in the station file, or correct the plan");
  return *aim->second * MakeLiftFromStation(lift_mm, station.lift.direction_in_station) *
         MakeStationFromTable(RadFromDeg(turntable_deg));
}

Status CheckFraming(const std::vector<PlannedView>& views, const StationDocument& station,
                    const BoundingCylinder& cylinder, double margin_px) {
  SCAN_CHECK(CheckCylinder(cylinder, margin_px));
  const PlannedView* worst_view = nullptr;
  Excess worst;
  std::size_t outside = 0;
  for (const PlannedView& view : views) {
    SCAN_TRY(const CameraFromTable camera_from_table,
             NominalPose(station, view.camera, view.aim_id, view.turntable_deg, view.lift_mm));
    const Intrinsics& k = FindCamera(station, view.camera)->intrinsics;
    const Excess excess = ExcessOfView(k, camera_from_table, cylinder, margin_px);
    if (excess.px <= 0) continue;
    ++outside;
    if (!worst_view || excess.px > worst.px) {
      worst = excess;
      worst_view = &view;
    }
  }
  if (!worst_view) return {};
  return tl::unexpected<Error>(FramingError(*worst_view, worst, margin_px, outside - 1));
}

}  // namespace scan
