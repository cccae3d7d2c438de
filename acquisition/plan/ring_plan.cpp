#include "acquisition/plan/ring_plan.h"

#include <fmt/format.h>

#include <cmath>
#include <set>

#include "acquisition/session/json_fields.h"

namespace scan {
namespace {

constexpr int kMaxRingViews = 3600;
constexpr std::size_t kMaxViews = 100000;

Status CheckId(const std::string& id, const std::string& what, const std::string& where) {
  if (IsId(id)) return {};
  return BadInput(fmt::format("{} '{}' is no id", what, id), where,
                  "use lower-case letters, digits and '-'");
}

Status CheckRing(const Ring& ring, const std::string& where) {
  if (ring.count < 1 || ring.count > kMaxRingViews)
    return BadInput(fmt::format("count {} is out of range", ring.count), where,
                    fmt::format("give 1 to {} views a ring", kMaxRingViews));
  if (ring.cameras.empty() || ring.cameras.size() > 100)
    return BadInput(fmt::format("{} cameras", ring.cameras.size()), where, "name 1 to 100");
  if (!std::isfinite(ring.lift_mm) || !std::isfinite(ring.start_deg))
    return BadInput("lift or start angle is not a number", where, "give finite mm and degrees");
  return {};
}

}  // namespace

Result<std::vector<PlannedView>> PlanRings(const std::vector<Ring>& rings) {
  std::vector<PlannedView> views;
  for (std::size_t r = 0; r < rings.size(); ++r) {
    const Ring& ring = rings[r];
    SCAN_CHECK(CheckRing(ring, fmt::format("ring {} of the plan", r)));
    if (views.size() + static_cast<std::size_t>(ring.count) * ring.cameras.size() > kMaxViews)
      return BadInput(fmt::format("more than {} views", kMaxViews),
                      fmt::format("ring {} of the plan", r), "split it into several sessions");
    for (int i = 0; i < ring.count; ++i) {
      for (const std::string& camera : ring.cameras) {
        PlannedView view;
        view.id = fmt::format("v{:03}", views.size());
        view.camera = camera;
        view.turntable_deg = ring.start_deg + 360.0 * i / ring.count;
        view.lift_mm = ring.lift_mm;
        view.exposure_us = ring.exposure_us;
        view.mounting_id = ring.mounting_id;
        view.aim_id = ring.aim_id;
        views.push_back(std::move(view));
      }
    }
  }
  SCAN_CHECK(CheckViews(views));
  return views;
}

Status CheckViews(const std::vector<PlannedView>& views) {
  if (views.empty()) return BadInput("no view is planned", "plan", "add a ring with a count");
  std::set<std::string> seen;
  for (const PlannedView& view : views) {
    const std::string where = fmt::format("view {} of the plan", view.id);
    SCAN_CHECK(CheckId(view.id, "view", where));
    SCAN_CHECK(CheckId(view.camera, "camera", where));
    SCAN_CHECK(CheckId(view.mounting_id, "mounting_id", where));
    SCAN_CHECK(CheckId(view.aim_id, "aim_id", where));
    if (!seen.insert(view.id).second)
      return BadInput("the view id is used twice", where, "give every view its own id");
    if (!std::isfinite(view.turntable_deg) || !std::isfinite(view.lift_mm))
      return BadInput("turntable_deg or lift_mm is not a number", where, "give finite numbers");
    if (!(view.exposure_us >= 0 && std::isfinite(view.exposure_us)))
      return BadInput(fmt::format("exposure_us {} is out of range", view.exposure_us), where,
                      "give microseconds above 0, or leave it out");
    if (view.slices < 1)
      return BadInput(fmt::format("slices {} is out of range", view.slices), where,
                      "give 1 or more");
  }
  return {};
}

}  // namespace scan
