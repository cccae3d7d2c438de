#include "reconstruction/pose/rig_attempt.h"

#include <algorithm>

#include "reconstruction/pose/centred_views.h"
#include "reconstruction/pose/choose_start.h"
#include "reconstruction/pose/outline_distance.h"

namespace scan {
namespace {

// Changes in turn uncover each other: what is left after the first solve is looked at again.
constexpr int kRounds = 2;

bool AnyLogged(const RigModel& rig) {
  return std::any_of(rig.views().begin(), rig.views().end(),
                     [](const RigView& view) { return view.logged; });
}

double DistanceOf(const AttemptInput& in, const RigAttempt& attempt, const std::vector<bool>& use) {
  return MeanOutlineDistance(in.mesh, attempt.rig, attempt.fit.parameters, in.photos, use,
                             1.5 * in.refine.last_window_px, in.refine.spacing_px);
}

// Changes are of a rig that shows this specimen: they leave most views in, and those explained.
// Else (another specimen, another scale or focal length) any rig could be bent to some outlines.
bool AreOfTheRig(const AttemptInput& in, const RigAttempt& attempt) {
  const auto views = std::count(in.use.begin(), in.use.end(), true);
  const auto left = std::count(attempt.use.begin(), attempt.use.end(), true);
  return 4 * left >= 3 * views &&
         DistanceOf(in, attempt, attempt.use) < kExplainedPx * UnitPx(in.refine);
}

Result<RigAttempt> Attempt(const AttemptInput& in, const RigModel& nominal, std::stop_token stop) {
  RigAttempt attempt{nominal, {}, {}, in.use, false, 0};
  RigModel& rig = attempt.rig;
  SCAN_CHECK(ChooseStarts(in.mesh, rig, in.photos, in.use, in.known, in.search, in.refine, stop));
  const RigParameters start =
      CentredViews(in.mesh, rig, in.photos, in.use, in.refine.centre_beyond_px);
  attempt.fit = RefineJoint(in.mesh, rig, in.photos, in.use, start, in.refine, stop);
  const RigAttempt plain = attempt;
  for (int round = 0; round < kRounds && AnyLogged(rig) && !stop.stop_requested(); ++round) {
    RigParameters parameters = attempt.fit.parameters;
    const auto found =
        FindChanges(in.mesh, rig, in.photos, attempt.use, in.refine,
                    attempt.fit.correlation.along_px, in.names, in.changes, parameters);
    if (found.empty()) break;
    for (const RigChange& change : found)
      if (change.kind == RigChange::Kind::view_alone)
        attempt.use[static_cast<std::size_t>(change.view)] = false;
    attempt.changes.insert(attempt.changes.end(), found.begin(), found.end());
    RemoveContained(attempt.changes);
    RefineOptions again = in.refine;
    again.first_window_px = 2 * in.refine.last_window_px;
    attempt.fit = Continued(
        attempt.fit, RefineJoint(in.mesh, rig, in.photos, attempt.use, parameters, again, stop));
  }
  if (stop.stop_requested()) return Cancelled("pose");
  if (!attempt.changes.empty() && !AreOfTheRig(in, attempt)) attempt = plain;
  attempt.distance_px = DistanceOf(in, attempt, in.use);
  return attempt;
}

}  // namespace

Result<RigAttempt> SolveWithChanges(const AttemptInput& input, const RigModel& rig,
                                    std::stop_token stop) {
  constexpr std::size_t kManyChanges = 3;
  SCAN_TRY(RigAttempt as_logged, Attempt(input, rig, stop));
  const double unit = UnitPx(input.refine);
  const bool turns = std::any_of(rig.views().begin(), rig.views().end(),
                                 [](const RigView& view) { return view.turns; });
  const bool explained =
      as_logged.distance_px < kExplainedPx * unit && as_logged.changes.size() < kManyChanges;
  if (!turns || explained) return as_logged;
  RigModel other = rig;
  other.ReverseTurntable();
  SCAN_TRY(RigAttempt reversed, Attempt(input, other, stop));
  const bool nearer = reversed.distance_px < 0.5 * as_logged.distance_px;
  const bool simpler = 2 * reversed.changes.size() < as_logged.changes.size() &&
                       reversed.distance_px < as_logged.distance_px + 0.2 * unit;
  if (!nearer && !simpler) return as_logged;
  reversed.reversed = true;
  return reversed;
}

}  // namespace scan
