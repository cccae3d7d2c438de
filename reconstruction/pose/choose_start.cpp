#include "reconstruction/pose/choose_start.h"

#include <algorithm>

#include "reconstruction/pose/centred_views.h"
#include "reconstruction/pose/outline_distance.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan {
namespace {

constexpr int kViews = 8;  // that compare candidates
constexpr int kFinal = 3;  // candidates compared with the full mesh, of which no two turned by less
constexpr double kSame_rad = 0.03;

// At most `count` of the views in use, evenly spread.
std::vector<bool> Spread(const std::vector<bool>& use, int count) {
  std::vector<std::size_t> members;
  for (std::size_t i = 0; i < use.size(); ++i)
    if (use[i]) members.push_back(i);
  std::vector<bool> some(use.size(), false);
  const std::size_t n = std::min<std::size_t>(members.size(), static_cast<std::size_t>(count));
  for (std::size_t k = 0; k < n; ++k) some[members[k * members.size() / n]] = true;
  return some;
}

struct Refined {
  TableFromModel table_from_model;
  double distance_px = 0;
};

Refined RefineFrom(const ContourMesh& mesh, RigModel& rig, int mounting,
                   const TableFromModel& start, std::span<const PhotoContour> photos,
                   const std::vector<bool>& use, const RefineOptions& options, double clip_px,
                   std::stop_token stop) {
  rig.set_start(mounting, start);
  const RefineResult fit = RefineJoint(
      mesh, rig, photos, use, CentredViews(mesh, rig, photos, use, options.centre_beyond_px),
      options, std::move(stop));
  return {rig.TableFromModelOf(fit.parameters, mounting),
          MeanOutlineDistance(mesh, rig, fit.parameters, photos, use, clip_px, options.spacing_px)};
}

}  // namespace

Result<std::vector<ChosenStart>> ChooseStarts(const ContourMesh& mesh, RigModel& rig,
                                              std::span<const PhotoContour> photos,
                                              const std::vector<bool>& use,
                                              const std::vector<bool>& known,
                                              const StartOptions& search,
                                              const RefineOptions& refine, std::stop_token stop) {
  const TriangleMesh coarse_triangles = MeshForRoughSteps(mesh);
  const ContourMesh coarse(coarse_triangles);
  const double unit = UnitPx(refine);
  std::vector<ChosenStart> chosen(rig.mounting_ids().size());
  for (std::size_t m = 0; m < chosen.size(); ++m) {
    const int mounting = static_cast<int>(m);
    chosen[m].table_from_model = rig.start(mounting);
    if (known[m]) continue;
    std::vector<bool> own = use;
    for (std::size_t i = 0; i < own.size(); ++i)
      own[i] = own[i] && rig.views()[i].mounting == mounting;
    if (std::none_of(own.begin(), own.end(), [](bool u) { return u; })) continue;
    const auto candidates = SearchStarts(mesh, rig, photos, own, search, stop);
    if (stop.stop_requested()) return Cancelled("pose");
    const std::vector<bool> some = Spread(own, kViews);
    RefineOptions rough = refine;
    rough.first_window_px = 60 * unit;
    rough.last_window_px = 16 * unit;
    rough.spacing_px = 3 * refine.spacing_px;
    rough.max_iterations = 12;
    rough.converged_px = 0.5 * unit;
    std::vector<Refined> refined;
    for (const StartCandidate& candidate : candidates) {
      refined.push_back(RefineFrom(coarse, rig, mounting, candidate.table_from_model, photos, some,
                                   rough, 40 * unit, stop));
      if (stop.stop_requested()) return Cancelled("pose");
    }
    std::stable_sort(refined.begin(), refined.end(), [](const Refined& a, const Refined& b) {
      return a.distance_px < b.distance_px;
    });
    // Many starts end at the same placing.
    std::vector<Refined> distinct;
    for (const Refined& r : refined)
      if (std::none_of(distinct.begin(), distinct.end(), [&](const Refined& d) {
            return AngleBetween(d.table_from_model.rotation(), r.table_from_model.rotation()) <
                   kSame_rad;
          }))
        distinct.push_back(r);
    RefineOptions fine = refine;
    fine.first_window_px = 24 * unit;
    fine.max_iterations = 8;
    fine.converged_px = 0.1 * unit;
    Refined best;
    for (int k = 0; k < std::min(kFinal, static_cast<int>(distinct.size())); ++k) {
      if (k > 0 && distinct[k].distance_px > 2 * distinct[0].distance_px + unit) break;
      const Refined full = RefineFrom(mesh, rig, mounting, distinct[k].table_from_model, photos,
                                      some, fine, 12 * unit, stop);
      if (stop.stop_requested()) return Cancelled("pose");
      if (k == 0 || full.distance_px < best.distance_px) best = full;
    }
    rig.set_start(mounting, best.table_from_model);
    chosen[m] = {best.table_from_model, best.distance_px};
  }
  return chosen;
}

}  // namespace scan
