#include "reconstruction/pose/rig_attempt.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "reconstruction/pose/acceptance.h"
#include "reconstruction/pose/choose_start.h"

namespace scan {
namespace {

// Changes in turn uncover each other: what is left after the first solve is looked at again.
constexpr int kRounds = 2;

bool AnyLogged(const RigModel& rig) {
  return std::any_of(rig.views().begin(), rig.views().end(),
                     [](const RigView& view) { return view.logged; });
}

double MeanDistance(const AttemptInput& in, const std::vector<bool>& use, const RigModel& rig,
                    const RigParameters& parameters) {
  const double clip_px = 1.5 * in.refine.last_window_px;
  std::vector<double> distance(in.photos.size(), 0);
  tbb::parallel_for(std::size_t{0}, in.photos.size(), [&](std::size_t i) {
    if (!use[i]) return;
    const ViewState state{rig.CameraFromModelOf(parameters, static_cast<int>(i)),
                          rig.IntrinsicsOf(parameters, rig.views()[i].lens),
                          parameters.mask_bias_px};
    distance[i] = TwoWayDistance(in.mesh, in.photos[i], state, clip_px, in.refine.spacing_px);
  });
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < distance.size(); ++i) {
    sum += distance[i];
    count += use[i] ? 1 : 0;
  }
  return sum / std::max(1.0, count);
}

// Changes are of a rig that shows this specimen: they leave most views in, and those explained.
// Else (another specimen, another scale or focal length) any rig could be bent to some outlines.
bool AreOfTheRig(const AttemptInput& in, const RigAttempt& attempt) {
  const auto views = std::count(in.use.begin(), in.use.end(), true);
  const auto left = std::count(attempt.use.begin(), attempt.use.end(), true);
  return 4 * left >= 3 * views &&
         MeanDistance(in, attempt.use, attempt.rig, attempt.fit.parameters) <
             kExplainedPx * UnitPx(in.refine);
}

Result<RigAttempt> Attempt(const AttemptInput& in, const RigModel& nominal, std::stop_token stop) {
  RigAttempt attempt{nominal, {}, {}, in.use, false, 0};
  RigModel& rig = attempt.rig;
  SCAN_CHECK(ChooseStarts(in.mesh, rig, in.photos, in.use, in.known, in.search, in.refine, stop));
  attempt.fit = RefineJoint(in.mesh, rig, in.photos, in.use, rig.Nominal(), in.refine, stop);
  const RigAttempt plain = attempt;
  for (int round = 0; round < kRounds && AnyLogged(rig) && !stop.stop_requested(); ++round) {
    RigParameters parameters = attempt.fit.parameters;
    const auto found = FindChanges(in.mesh, rig, in.photos, attempt.use, in.refine,
                                   attempt.fit.correlation_px, in.names, in.changes, parameters);
    if (found.empty()) break;
    for (const RigChange& change : found)
      if (change.kind == RigChange::Kind::view_alone)
        attempt.use[static_cast<std::size_t>(change.view)] = false;
    attempt.changes.insert(attempt.changes.end(), found.begin(), found.end());
    RefineOptions again = in.refine;
    again.first_window_px = 2 * in.refine.last_window_px;
    attempt.fit = RefineJoint(in.mesh, rig, in.photos, attempt.use, parameters, again, stop);
  }
  if (stop.stop_requested()) return Cancelled("pose");
  if (!attempt.changes.empty() && !AreOfTheRig(in, attempt)) attempt = plain;
  attempt.distance_px = MeanDistance(in, in.use, attempt.rig, attempt.fit.parameters);
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
