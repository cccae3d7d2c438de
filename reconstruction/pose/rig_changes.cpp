#include "reconstruction/pose/rig_changes.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "reconstruction/pose/acceptance.h"
#include "reconstruction/pose/lens_distortion.h"
#include "reconstruction/pose/rigid_motion.h"
#include "reconstruction/pose/view_start.h"

namespace scan {
namespace {

// How a view's motion follows from the parameters of a change.
using ChangeColumns = Eigen::Matrix<double, kEvidenceSize, Eigen::Dynamic>;

// A view as the changes see it: its own deviations, bound by their priors, are already given way.
struct ViewTerms {
  bool used = false;
  ChangeColumns shared;                              // motion by the shared parameters, whitened
  EvidenceMatrix H = EvidenceMatrix::Zero();         // information left
  EvidenceVector pull = EvidenceVector::Zero();      // gradient by the motion
  Eigen::Matrix<double, kEvidenceSize, 1> by_angle;  // motion by the turntable's angle
  Eigen::Matrix<double, kEvidenceSize, 6> by_placing;
};

// Where the view stands from the state that its evidence was linearised about.
EvidenceVector MotionFromEvidence(const RigModel& rig, const RigParameters& parameters, int view,
                                  const CondensedEvidence& evidence) {
  const ViewState& state = evidence.state;
  const Intrinsics now = rig.IntrinsicsOf(parameters, rig.views()[view].lens);
  EvidenceVector y;
  y.head<6>() = MotionBetween(state.camera_from_model, rig.CameraFromModelOf(parameters, view),
                              evidence.pivot);
  y[6] = std::log(now.fl_x / state.intrinsics.fl_x);
  y[7] = now.cx - state.intrinsics.cx;
  y[8] = now.cy - state.intrinsics.cy;
  y[9] = parameters.mask_bias_px - state.mask_bias_px;
  y[10] = (now.k1 - state.intrinsics.k1) / K1OfCorner(state.intrinsics);
  return y;
}

class ChangeTest {
 public:
  ChangeTest(const RigModel& rig, const RigEvidence& evidence, const RigParameters& parameters)
      : rig_(rig), terms_(evidence.size()) {
    const RigLayout layout(rig);
    Eigen::VectorXd sigma = PriorSigmas(rig, layout);
    for (int lens = 0; lens < static_cast<int>(rig.lens_sigma().size()); ++lens)
      for (int k = 0; k < kLensSize; ++k)
        if (rig.held(lens, k)) sigma[layout.lens(lens) + k] = 0;
    const int shared = layout.view(0);
    Eigen::MatrixXd information = Eigen::MatrixXd::Identity(shared, shared);
    for (std::size_t i = 0; i < evidence.size(); ++i) {
      if (!evidence[i]) continue;
      const int view = static_cast<int>(i);
      ViewTerms& t = terms_[i];
      t.used = true;
      const Eigen::MatrixXd J = ViewJacobian(rig, layout, parameters, view, evidence[i]->pivot);
      t.by_angle = J.col(layout.epoch(rig.views()[i].epoch));
      t.by_placing = J.middleCols<6>(layout.mounting(rig.views()[i].mounting));
      t.shared = J.leftCols(shared) * sigma.head(shared).asDiagonal();
      const Eigen::Matrix<double, kEvidenceSize, 8> own =
          J.middleCols<8>(layout.view(view)) * sigma.segment<8>(layout.view(view)).asDiagonal();
      const EvidenceMatrix& H = evidence[i]->H;
      const Eigen::Matrix<double, 8, 8> inner =
          Eigen::Matrix<double, 8, 8>::Identity() + own.transpose() * H * own;
      t.H = H - H * own * inner.llt().solve(own.transpose() * H);
      t.pull = H * MotionFromEvidence(rig, parameters, view, *evidence[i]) + evidence[i]->g;
      information += t.shared.transpose() * t.H * t.shared;
    }
    information_.compute(information);
  }

  const std::vector<ViewTerms>& terms() const { return terms_; }

  // What freeing a change's parameters gains; `columns(i)` tells how view i of `views` moves, in
  // units of the change's priors.
  template <class Columns>
  double Gain(const std::vector<int>& views, int size, Columns&& columns) const {
    Eigen::MatrixXd A = Eigen::MatrixXd::Identity(size, size);
    Eigen::MatrixXd C = Eigen::MatrixXd::Zero(information_.cols(), size);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(size);
    for (const int i : views) {
      const ViewTerms& t = terms_[static_cast<std::size_t>(i)];
      const ChangeColumns D = columns(t);
      A += D.transpose() * t.H * D;
      C += t.shared.transpose() * t.H * D;
      b += D.transpose() * t.pull;
    }
    A -= C.transpose() * information_.solve(C);
    return 0.5 * b.dot(A.ldlt().solve(b));
  }

 private:
  const RigModel& rig_;
  std::vector<ViewTerms> terms_;
  Eigen::LLT<Eigen::MatrixXd> information_;
};

// Priors of a change's size: wide, they only keep what the outlines do not show.
constexpr double kTurn_rad = 0.3;
constexpr double kShift_mm = 20;
Vector6d RigidSigmas() {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(kTurn_rad), Eigen::Vector3d::Constant(kShift_mm);
  return sigma;
}

// The views used, taken since `view`, that `same` says belong together with it; empty when fewer
// than two stand on either side: such a change is that of one view.
template <class Same>
std::vector<int> TakenSince(const RigModel& rig, const std::vector<ViewTerms>& terms, int view,
                            Same&& same) {
  std::vector<int> after;
  int before = 0;
  for (int i = 0; i < static_cast<int>(terms.size()); ++i) {
    if (!terms[static_cast<std::size_t>(i)].used || !same(i)) continue;
    if (rig.views()[i].taken < rig.views()[view].taken) {
      ++before;
    } else {
      after.push_back(i);
    }
  }
  if (before < 2 || after.size() < 2) after.clear();
  return after;
}

// Whether the views are all of a mounting: a turn of these is one of its placing.
bool IsWholeMounting(const RigModel& rig, const std::vector<ViewTerms>& terms,
                     const std::vector<int>& views) {
  const int mounting = rig.views()[views.front()].mounting;
  std::size_t members = 0;
  for (std::size_t k = 0; k < terms.size(); ++k)
    members += terms[k].used && rig.views()[k].mounting == mounting;
  return members == views.size() && std::all_of(views.begin(), views.end(), [&](int k) {
           return rig.views()[k].mounting == mounting;
         });
}

// The epoch that one with this ending of its name was split from; none for any other.
std::optional<int> EpochSplitFrom(const RigModel& rig, int epoch, const std::string& ending) {
  const auto& names = rig.epoch_names();
  const std::string& name = names[static_cast<std::size_t>(epoch)];
  if (!name.ends_with(ending)) return std::nullopt;
  const auto found =
      std::find(names.begin(), names.begin() + epoch, name.substr(0, name.size() - ending.size()));
  if (found == names.begin() + epoch) return std::nullopt;
  return static_cast<int>(found - names.begin());
}

RigChange Better(const RigChange& a, const RigChange& b) { return b.gain > a.gain ? b : a; }

}  // namespace

RigEvidence EvidenceOfViewsAlone(const ContourMesh& mesh, const RigModel& rig,
                                 std::span<const PhotoContour> photos, const std::vector<bool>& use,
                                 const RigParameters& parameters, double correlation_px,
                                 const RefineOptions& options) {
  // 99.9 % of what six parameters gain by chance: half of chi squared.
  constexpr double kLeastGain = 11.2;
  RefineOptions alone = options;
  alone.first_window_px = options.first_window_px / 2;
  RigEvidence evidence(photos.size());
  tbb::parallel_for(std::size_t{0}, photos.size(), [&](std::size_t i) {
    if (!use[i]) return;
    const ViewState by_rig{rig.CameraFromModelOf(parameters, static_cast<int>(i)),
                           rig.IntrinsicsOf(parameters, rig.views()[i].lens),
                           parameters.mask_bias_px};
    ViewState own = by_rig;
    own.camera_from_model = RefineView(mesh, photos[i], by_rig, alone);
    const auto fit_at = [&](const ViewState& state) {
      return FitView(mesh, photos[i], state, options.last_window_px, {.along_px = correlation_px},
                     options);
    };
    ViewFit fit = fit_at(own);
    const auto misfit = [&](const ViewState& state) {
      return Misfit(mesh, photos[i], state, fit.sigma_px, correlation_px, options.spacing_px);
    };
    // The noise is as unknown as the pose: the logarithm of the likelihood ratio is that of the
    // variances, for each independent observation of the outline.
    const double gain =
        0.5 * photos[i].length_px / correlation_px * std::log(misfit(by_rig) / misfit(own));
    if (!(gain > kLeastGain)) fit = fit_at(by_rig);
    evidence[i] = std::move(fit.evidence);
  });
  return evidence;
}

std::optional<RigChange> MostLikelyChange(const RigModel& rig, const RigEvidence& evidence,
                                          const RigParameters& parameters, double cost,
                                          const ChangeOptions& options) {
  const ChangeTest test(rig, evidence, parameters);
  const std::vector<ViewTerms>& terms = test.terms();
  const Vector6d sigma = RigidSigmas();
  RigChange steps{RigChange::Kind::steps_lost}, moved{RigChange::Kind::specimen_moved}, alone;
  int used = 0;
  for (int i = 0; i < static_cast<int>(terms.size()); ++i) {
    if (!terms[static_cast<std::size_t>(i)].used) continue;
    ++used;
    const RigView& view = rig.views()[i];
    alone = Better(alone, {RigChange::Kind::view_alone, i, test.Gain({i}, 6, [&](const ViewTerms&) {
                             ChangeColumns D = ChangeColumns::Zero(kEvidenceSize, 6);
                             D.topRows<6>() = sigma.asDiagonal();
                             return D;
                           })});
    const auto turned = TakenSince(rig, terms, i, [&](int k) {
      return rig.views()[k].turns && rig.views()[k].epoch == view.epoch;
    });
    if (view.turns && !turned.empty() && !IsWholeMounting(rig, terms, turned))
      steps = Better(steps, {RigChange::Kind::steps_lost, i,
                             test.Gain(turned, 1, [&](const ViewTerms& t) -> ChangeColumns {
                               return t.by_angle * options.steps_sigma_rad;
                             })});
    const auto placed =
        TakenSince(rig, terms, i, [&](int k) { return rig.views()[k].mounting == view.mounting; });
    if (!placed.empty())
      moved = Better(moved, {RigChange::Kind::specimen_moved, i,
                             test.Gain(placed, 6, [&](const ViewTerms& t) -> ChangeColumns {
                               return t.by_placing * sigma.asDiagonal();
                             })});
  }
  const auto believed = [&](const RigChange& change, int freedom) {
    const double remains = std::max(0.0, cost - change.gain);
    const double scatter = std::max(1.0, 2 * remains / std::max(1, 6 * used));
    return change.gain > (options.least_gain + 2 * freedom) * scatter &&
           change.gain > options.least_share * cost;
  };
  const double rigid = std::max(moved.gain, alone.gain);
  const double slack = std::max(options.least_gain, options.simple_share * rigid);
  if (steps.gain > rigid - slack && believed(steps, 1)) return steps;
  const RigChange best = Better(moved, alone);
  if (believed(best, 6)) return best;
  return std::nullopt;
}

void RemoveContained(std::vector<RigChange>& changes) {
  const std::vector<RigChange> all = changes;
  std::erase_if(changes, [&](const RigChange& steps) {
    return steps.kind == RigChange::Kind::steps_lost &&
           std::any_of(all.begin(), all.end(), [&](const RigChange& moved) {
             return moved.kind == RigChange::Kind::specimen_moved && moved.view == steps.view;
           });
  });
}

std::vector<RigChange> FindChanges(const ContourMesh& mesh, RigModel& rig,
                                   std::span<const PhotoContour> photos,
                                   const std::vector<bool>& use, const RefineOptions& refine,
                                   double correlation_px, std::span<const std::string> names,
                                   const ChangeOptions& options, RigParameters& parameters) {
  std::vector<RigChange> changes;
  RigEvidence evidence =
      EvidenceOfViewsAlone(mesh, rig, photos, use, parameters, correlation_px, refine);
  while (static_cast<int>(changes.size()) < options.most) {
    const double cost = SolveRig(rig, evidence, parameters);
    auto change = MostLikelyChange(rig, evidence, parameters, cost, options);
    if (!change) break;
    const RigView& view = rig.views()[change->view];
    const std::string from = "-from-" + names[static_cast<std::size_t>(change->view)];
    switch (change->kind) {
      case RigChange::Kind::steps_lost:
        rig.SplitEpoch(change->view, rig.epoch_names()[view.epoch] + from, options.steps_sigma_rad,
                       parameters);
        break;
      case RigChange::Kind::specimen_moved:
        // A new placing also holds what a new offset from there on would: that one goes.
        if (const auto before = EpochSplitFrom(rig, view.epoch, from))
          rig.JoinEpoch(view.epoch, *before, parameters);
        rig.SplitMounting(change->view, rig.mounting_ids()[view.mounting] + from, parameters);
        break;
      case RigChange::Kind::view_alone:
        evidence[static_cast<std::size_t>(change->view)].reset();
        break;
    }
    changes.push_back(*change);
  }
  RemoveContained(changes);
  return changes;
}

}  // namespace scan
