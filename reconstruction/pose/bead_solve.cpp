#include "reconstruction/pose/bead_solve.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "drivers/base/units.h"
#include "reconstruction/pose/bead_evidence.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan {
namespace {

using Turn = Transform<frame::Model, frame::Model>;

Turn TurnAboutScrew(const Screw& screw, double angle) {
  const Eigen::Matrix3d rotation = ExpSo3(angle * screw.axis);
  return Turn(rotation, screw.point - rotation * screw.point);
}

// Recognised beads, nearer ones counting more, less half of those that should be seen but are not.
double ScoreOfView(const BeadScene& scene, const BeadView& view, const CameraFromModel& pose,
                   const BeadMatchOptions& options) {
  constexpr int kSamples = 7;
  ViewState state = view.state;
  state.camera_from_model = pose;
  double score = 0;
  for (std::size_t b = 0; b < scene.beads().size(); ++b) {
    const auto seen = scene.Appearance(b, state, kSamples);
    if (!seen || seen->share < options.least_share) continue;
    const double reach = std::max(options.least_reach_px, options.reach_radii * seen->radius_px);
    double best = seen->share >= options.clear_share ? -0.5 : 0.0;
    for (const BeadImage& image : view.images) {
      const double ratio = image.area_px / seen->area_px();
      const double distance = (image.centre - seen->centroid).norm() / reach;
      if (distance > 1 || ratio > 1.5 * options.area_factor ||
          ratio * 1.5 * options.area_factor < 1)
        continue;
      best = std::max(best, 1 - distance * distance);
    }
    score += best;
  }
  return score;
}

// What the solve of one session with beads goes through.
class BeadSolver {
 public:
  BeadSolver(const ContourMesh& mesh, const BeadFindings& findings, const BeadOptions& options,
             const ObservabilityOptions& observability, RigAttempt& attempt)
      : mesh_(mesh),
        findings_(findings),
        options_(options),
        observability_(observability),
        attempt_(attempt),
        scene_(mesh.mesh, findings.beads),
        smooth_(SmoothNormalsOf(mesh, observability.smoothing)),
        parameters_(attempt.fit.parameters),
        believed_(attempt.rig.mounting_ids().size(), true),
        left_out_(findings.beads.size(), false) {}

  RigParameters& parameters() { return parameters_; }
  std::vector<std::string>& notes() { return notes_; }
  bool turned() const { return turned_; }

  void TurnMountings() {
    for (int m = 0; m < static_cast<int>(believed_.size()); ++m)
      believed_[static_cast<std::size_t>(m)] = TurnMounting(m);
  }

  // `reach`: of BeadMatchOptions::reach_radii. Returns the number of sightings.
  std::size_t Recognise(double reach, std::span<PhotoContour> photos) {
    BeadMatchOptions match = options_.match;
    match.reach_radii = reach;
    std::vector<BeadMatches> matches(photos.size());
    tbb::parallel_for(std::size_t{0}, photos.size(), [&](std::size_t i) {
      const auto m = static_cast<std::size_t>(attempt_.rig.views()[i].mounting);
      if (attempt_.use[i] && believed_[m])
        matches[i] = MatchBeads(scene_, findings_.images[i], StateOf(i), left_out_, match);
    });
    LeaveOutUnseen(matches);
    DisbelieveFewSightings(matches);
    std::vector<std::size_t> count(left_out_.size(), 0);
    strangers_ = 0;
    std::size_t total = 0;
    for (std::size_t i = 0; i < photos.size(); ++i) {
      const bool believed = believed_[static_cast<std::size_t>(attempt_.rig.views()[i].mounting)];
      photos[i].beads = believed ? matches[i].sightings : std::vector<BeadSighting>{};
      std::erase_if(photos[i].beads, [&](const BeadSighting& s) {
        return left_out_[static_cast<std::size_t>(s.bead)];
      });
      for (const BeadSighting& s : photos[i].beads) ++count[static_cast<std::size_t>(s.bead)];
      total += photos[i].beads.size();
      if (believed) strangers_ += matches[i].strangers;
    }
    // The CT's error of a centre is the same in all views: as part of each sighting's own it must
    // not average out.
    for (std::size_t i = 0; i < photos.size(); ++i)
      for (BeadSighting& s : photos[i].beads) {
        const auto b = static_cast<std::size_t>(s.bead);
        const ViewState state = StateOf(i);
        const double px_per_mm = state.intrinsics.fl_x / (state.camera_from_model * s.centre).z();
        s.sigma_px = std::hypot(s.sigma_px, std::sqrt(static_cast<double>(count[b])) * px_per_mm *
                                                findings_.beads[b].sigma_mm);
      }
    return total;
  }

  void NoteStrangers() {
    if (strangers_ > 0)
      notes_.push_back(fmt::format(
          "Patches of the beads' colour where no bead is: {}; they were left aside.", strangers_));
  }

  ViewState StateOf(std::size_t i) const {
    return {attempt_.rig.CameraFromModelOf(parameters_, static_cast<int>(i)),
            attempt_.rig.IntrinsicsOf(parameters_, attempt_.rig.views()[i].lens),
            parameters_.mask_bias_px};
  }

 private:
  std::string NameOf(int mounting) const {
    const std::string& id = attempt_.rig.mounting_ids()[static_cast<std::size_t>(mounting)];
    return RigModel::IsViewMounting(id) ? "View" + id : "Mounting " + id;
  }

  // False where the beads do not show how the mounting is turned.
  bool TurnMounting(int m) {
    std::vector<int> views;
    std::vector<BeadView> seen;
    for (std::size_t i = 0; i < attempt_.use.size(); ++i) {
      if (!attempt_.use[i] || attempt_.rig.views()[i].mounting != m ||
          !attempt_.fit.fits[i].evidence)
        continue;
      views.push_back(static_cast<int>(i));
      seen.push_back({StateOf(i), findings_.images[i]});
    }
    if (views.empty()) return false;
    Screw axis = SlippageAxisOf(mesh_, smooth_, attempt_.rig, parameters_, views);
    int free = 0;
    for (const FreeDirection& direction :
         FreeDirectionsOf(mesh_, smooth_, attempt_.rig, attempt_.fit, views, observability_)) {
      if (direction.kind != FreeDirection::Kind::rotation) continue;
      if (++free == 1) axis = {direction.axis, direction.point};
    }
    const auto turns = ScoreTurns(scene_, seen, axis, options_.match);
    if (!turns || turns->best <= 0) return free == 0;
    const bool as_is = turns->as_is >= options_.as_good * turns->best;
    if (as_is && free == 0) return true;
    if (turns->second >= options_.as_good * turns->best) {
      notes_.push_back(fmt::format(
          "{}: turned by {:.0f}° about the axis ({:.3f}, {:.3f}, {:.3f}) of the model the specimen "
          "explains the beads in the photographs as well: they do not tell the two apart and were "
          "left aside. Glue three at uneven distances, so that each photograph shows two.",
          NameOf(m), DegFromRad(std::remainder(turns->second_rad - turns->best_rad, 2 * kPi)),
          axis.axis.x(), axis.axis.y(), axis.axis.z()));
      return false;
    }
    if (as_is) return true;
    const TableFromModel placing = attempt_.rig.TableFromModelOf(parameters_, m);
    attempt_.rig.set_start(m, placing * TurnAboutScrew(axis, turns->best_rad));
    parameters_.mountings[static_cast<std::size_t>(m)] = {};
    turned_ = true;
    return true;
  }

  void LeaveOutUnseen(std::span<const BeadMatches> matches) {
    constexpr std::size_t kLeastViews = 2;
    std::vector<std::size_t> expected(left_out_.size(), 0), seen(left_out_.size(), 0);
    for (const BeadMatches& view : matches) {
      for (const int b : view.expected) ++expected[static_cast<std::size_t>(b)];
      for (const BeadSighting& s : view.sightings) ++seen[static_cast<std::size_t>(s.bead)];
    }
    for (std::size_t b = 0; b < left_out_.size(); ++b) {
      if (left_out_[b] || expected[b] < kLeastViews ||
          static_cast<double>(seen[b]) >= options_.seen_share * static_cast<double>(expected[b]))
        continue;
      left_out_[b] = true;
      const Eigen::Vector3d& c = findings_.beads[b].centre;
      notes_.push_back(fmt::format(
          "The bead at ({:.2f}, {:.2f}, {:.2f}) mm of the model is seen in {} of {} photographs "
          "that should show it: it was left out. Perhaps it fell off or moved since the CT.",
          c.x(), c.y(), c.z(), seen[b], expected[b]));
    }
  }

  void DisbelieveFewSightings(std::span<const BeadMatches> matches) {
    for (int m = 0; m < static_cast<int>(believed_.size()); ++m) {
      if (!believed_[static_cast<std::size_t>(m)]) continue;
      std::size_t sightings = 0, images = 0, views = 0;
      for (std::size_t i = 0; i < matches.size(); ++i) {
        if (attempt_.rig.views()[i].mounting != m || !attempt_.use[i]) continue;
        ++views;
        images += findings_.images[i].size();
        for (const BeadSighting& s : matches[i].sightings)
          sightings += !left_out_[static_cast<std::size_t>(s.bead)];
      }
      const bool alone =
          RigModel::IsViewMounting(attempt_.rig.mounting_ids()[static_cast<std::size_t>(m)]);
      if (sightings >= (alone ? std::size_t{2} : options_.least_sightings)) continue;
      believed_[static_cast<std::size_t>(m)] = false;
      if (views == 0 || alone) continue;
      notes_.push_back(fmt::format(
          "{}: beads were recognised {} times in {} photographs with {} patches of their colour: "
          "too few to be evidence. Check the beads' colour.",
          NameOf(m), sightings, views, images));
    }
  }

  const ContourMesh& mesh_;
  const BeadFindings& findings_;
  const BeadOptions& options_;
  const ObservabilityOptions& observability_;
  RigAttempt& attempt_;
  BeadScene scene_;
  SmoothNormals smooth_;
  RigParameters parameters_;
  std::vector<bool> believed_;  // by mounting
  std::vector<bool> left_out_;  // by bead
  bool turned_ = false;
  std::size_t strangers_ = 0;
  std::vector<std::string> notes_;
};

}  // namespace

std::optional<BeadTurns> ScoreTurns(const BeadScene& scene, std::span<const BeadView> views,
                                    const Screw& axis, const BeadMatchOptions& options) {
  double farthest = 0, radius = 0;
  for (const Bead& bead : scene.beads()) {
    farthest = std::max(farthest, (bead.centre - axis.point).cross(axis.axis).norm());
    radius = std::max(radius, bead.radius_mm);
  }
  if (farthest < 2 * radius || radius <= 0) return {};
  const int steps =
      std::clamp(static_cast<int>(std::ceil(2 * kPi * farthest / (0.5 * radius))), 36, 3600);
  std::vector<double> score(static_cast<std::size_t>(steps), 0);
  tbb::parallel_for(std::size_t{0}, score.size(), [&](std::size_t k) {
    const Turn turn = TurnAboutScrew(axis, 2 * kPi * static_cast<double>(k) / steps);
    for (const BeadView& view : views)
      score[k] += ScoreOfView(scene, view, view.state.camera_from_model * turn, options);
  });
  const auto angle = [&](std::size_t k) { return 2 * kPi * static_cast<double>(k) / steps; };
  BeadTurns turns;
  turns.neighbour_rad = std::min(kPi / 2, 2.5 * options.reach_radii * radius / farthest);
  const auto best =
      static_cast<std::size_t>(std::max_element(score.begin(), score.end()) - score.begin());
  turns.best_rad = angle(best);
  turns.best = score[best];
  turns.as_is = score[0];
  turns.second = -1e300;
  for (std::size_t k = 0; k < score.size(); ++k) {
    if (std::abs(std::remainder(angle(k) - turns.best_rad, 2 * kPi)) < turns.neighbour_rad ||
        score[k] <= turns.second)
      continue;
    turns.second = score[k];
    turns.second_rad = angle(k);
  }
  return turns;
}

BeadOutcome SolveWithBeads(const ContourMesh& mesh, const BeadFindings& findings,
                           const BeadOptions& options, const RefineOptions& refine,
                           const ObservabilityOptions& observability,
                           std::span<PhotoContour> photos, RigAttempt& attempt,
                           std::stop_token stop) {
  // Nearer each time: a bead that moved since the CT is first taken for itself.
  const double reaches[] = {options.match.reach_radii, 0.5 * options.match.reach_radii,
                            0.35 * options.match.reach_radii};
  BeadOutcome outcome;
  BeadSolver solver(mesh, findings, options, observability, attempt);
  solver.TurnMountings();
  outcome.turned = solver.turned();
  RefineOptions again = refine;
  again.first_window_px = 2 * refine.last_window_px;
  for (const double reach : reaches) {
    outcome.sightings = solver.Recognise(reach, photos);
    if (outcome.sightings == 0 || stop.stop_requested()) break;
    attempt.fit = Continued(attempt.fit, RefineJoint(mesh, attempt.rig, photos, attempt.use,
                                                     solver.parameters(), again, stop));
    solver.parameters() = attempt.fit.parameters;
  }
  if (outcome.sightings > 0) {
    solver.NoteStrangers();
    double squares = 0;
    std::vector<bool> recognised(findings.beads.size(), false);
    for (std::size_t i = 0; i < photos.size(); ++i)
      for (const BeadSighting& s : photos[i].beads) {
        squares +=
            BeadResidual(solver.StateOf(i), s, Eigen::Vector3d::Zero(), nullptr).squaredNorm();
        recognised[static_cast<std::size_t>(s.bead)] = true;
      }
    outcome.residual_px = std::sqrt(squares / (2.0 * static_cast<double>(outcome.sightings)));
    outcome.notes.push_back(fmt::format(
        "{} of {} beads were recognised, {} times in all; they lie {:.2f} px (RMS) from where the "
        "poses put them.",
        std::count(recognised.begin(), recognised.end(), true), findings.beads.size(),
        outcome.sightings, outcome.residual_px));
  }
  outcome.notes.insert(outcome.notes.end(), solver.notes().begin(), solver.notes().end());
  return outcome;
}

}  // namespace scan
