#include "reconstruction/evaluate/pose_trial.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "drivers/base/units.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan {
namespace {

using ModelFromModel = Transform<frame::Model, frame::Model>;

double Wrapped(double rad) { return std::remainder(rad, 2 * kPi); }

// Angle of the part of a rotation that turns about `axis` (swing and twist).
double TwistAbout(const Eigen::Vector3d& axis, const Eigen::Matrix3d& rotation) {
  const Eigen::Quaterniond q(rotation);
  return Wrapped(2 * std::atan2(q.vec().dot(axis), q.w()));
}

ModelFromModel TurnAbout(const FreeDirection& free, double angle) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, free.axis.normalized()).toRotationMatrix();
  return ModelFromModel(turn, free.point - turn * free.point);
}

bool Concerns(const FreeDirection& free, const ViewPose& view) {
  if (free.kind != FreeDirection::Kind::rotation) return false;
  return free.of == (free.scope == FreeDirection::Scope::view ? view.name : view.mounting);
}

// The one angle about a free axis that most views agree on: of the views' own angles the one with
// the least sum of differences from all others.
double CommonTurn(const PoseTrial& trial, const Poses& poses, const FreeDirection& free) {
  const std::vector<double> angles = TurnErrors(trial, poses, free);
  double best = 0, least = std::numeric_limits<double>::infinity();
  for (const double candidate : angles) {
    double sum = 0;
    for (const double angle : angles) sum += std::abs(Wrapped(angle - candidate));
    if (sum < least) {
      least = sum;
      best = candidate;
    }
  }
  return best;
}

double Nees(const ViewPose& view, const CameraFromModel& solved, const CameraFromModel& truth) {
  const Vector6d error = MotionBetween(solved, truth, Eigen::Vector3d::Zero());
  // In units of the sigmas: rad and mm differ by orders of magnitude.
  const Vector6d scale = view.covariance.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
  const Matrix6d scaled = scale.asDiagonal() * view.covariance * scale.asDiagonal();
  const Vector6d u = scale.cwiseProduct(error);
  return u.dot(scaled.ldlt().solve(u));
}

std::string SpreadText(const Spread& spread, int digits) {
  return fmt::format("{:9.{}f} {:9.{}f} {:9.{}f}", spread.median, digits, spread.p95, digits,
                     spread.max, digits);
}

}  // namespace

std::vector<double> TurnErrors(const PoseTrial& trial, const Poses& poses,
                               const FreeDirection& free) {
  std::vector<double> angles;
  for (std::size_t i = 0; i < poses.views.size(); ++i) {
    const ViewPose& view = poses.views[i];
    if (view.status != ViewStatus::accepted || !Concerns(free, view)) continue;
    const Eigen::Matrix3d error =
        trial.truth[i].camera_from_model.rotation().transpose() * view.camera_from_model.rotation();
    angles.push_back(TwistAbout(free.axis.normalized(), error));
  }
  return angles;
}

PoseTrial Subset(const PoseTrial& trial, std::span<const std::size_t> indices) {
  PoseTrial subset;
  subset.photos = trial.photos;
  subset.photos.photos.clear();
  subset.mesh = trial.mesh;
  subset.surface = trial.surface;
  for (const std::size_t i : indices) {
    subset.photos.photos.push_back(trial.photos.photos[i]);
    subset.masks.push_back(trial.masks[i]);
    subset.truth.push_back(trial.truth[i]);
  }
  return subset;
}

std::vector<std::size_t> EvenlySpread(std::size_t total, std::size_t count) {
  count = std::min(total, count);
  std::vector<std::size_t> indices(count);
  for (std::size_t k = 0; k < count; ++k) indices[k] = k * total / count;
  return indices;
}

MethodFigures ScorePoses(const PoseTrial& trial, const Poses& poses,
                         std::span<const FreeDirection> free) {
  MethodFigures figures;
  figures.method = poses.method;
  figures.free_directions = poses.free_directions;
  figures.views.resize(poses.views.size());
  std::vector<double> turns;
  for (const FreeDirection& direction : free) turns.push_back(CommonTurn(trial, poses, direction));
  tbb::parallel_for(std::size_t{0}, poses.views.size(), [&](std::size_t i) {
    const ViewPose& view = poses.views[i];
    ViewFigures& f = figures.views[i];
    f.name = view.name;
    f.accepted = view.status == ViewStatus::accepted;
    f.reason = view.reason;
    f.cost_px = view.cost_px;
    f.cost_l1_px = view.cost_l1_px;
    const Intrinsics& intrinsics =
        IntrinsicsOf(poses, view, trial.photos.intrinsics(trial.photos.photos[i]));
    f.error = ScorePose(trial.surface, trial.truth[i], PoseOf{view.camera_from_model, intrinsics});
    f.turned = f.error;
    CameraFromModel turned = view.camera_from_model;
    bool moved = false;
    for (std::size_t k = 0; k < free.size(); ++k) {
      if (!Concerns(free[k], view)) continue;
      turned = turned * TurnAbout(free[k], -turns[k]);
      moved = true;
    }
    if (moved) f.turned = ScorePose(trial.surface, trial.truth[i], PoseOf{turned, intrinsics});
    f.nees = Nees(view, turned, trial.truth[i].camera_from_model);
    f.centre_sigma_mm = std::sqrt(view.covariance.diagonal().tail<3>().sum());
  });
  return figures;
}

MethodSummary Summarise(const MethodFigures& figures, double wrong_px) {
  MethodSummary summary;
  summary.views = figures.views.size();
  std::vector<double> centre, rotation, surface, cost, centre_raw, surface_raw;
  double squares = 0, variances = 0;
  for (const ViewFigures& view : figures.views) {
    if (!view.accepted) continue;
    ++summary.accepted;
    summary.wrong += view.turned.surface_rms_px > wrong_px;
    centre.push_back(view.turned.centre_mm);
    rotation.push_back(DegFromRad(view.turned.rotation_rad));
    surface.push_back(view.turned.surface_rms_px);
    cost.push_back(view.cost_px);
    centre_raw.push_back(view.error.centre_mm);
    surface_raw.push_back(view.error.surface_rms_px);
    summary.mean_nees += view.nees;
    squares += view.error.centre_mm * view.error.centre_mm;
    variances += view.centre_sigma_mm * view.centre_sigma_mm;
  }
  if (summary.accepted > 0) {
    const double count = static_cast<double>(summary.accepted);
    summary.mean_nees /= count;
    summary.centre_rms_mm = std::sqrt(squares / count);
    if (variances > 0) summary.centre_per_sigma = std::sqrt(squares / variances);
  }
  summary.centre_mm = SpreadOf(std::move(centre));
  summary.rotation_deg = SpreadOf(std::move(rotation));
  summary.surface_px = SpreadOf(std::move(surface));
  summary.cost_px = SpreadOf(std::move(cost));
  summary.centre_raw_mm = SpreadOf(std::move(centre_raw));
  summary.surface_raw_px = SpreadOf(std::move(surface_raw));
  return summary;
}

std::size_t CountWithin(const MethodFigures& figures, double centre_mm, double rotation_deg) {
  return static_cast<std::size_t>(
      std::count_if(figures.views.begin(), figures.views.end(), [&](const ViewFigures& view) {
        return view.error.centre_mm <= centre_mm &&
               DegFromRad(view.error.rotation_rad) <= rotation_deg;
      }));
}

std::string TableOf(std::span<const MethodFigures> methods, double wrong_px, bool per_view) {
  std::string text;
  for (const MethodFigures& method : methods) {
    const MethodSummary s = Summarise(method, wrong_px);
    text += fmt::format(
        "{}: {} of {} accepted, {} of these wrong by more than {:g} px, {:.1f} s\n"
        "                         median       p95       max\n"
        "  surface RMS, px     {}\n  camera centre, mm   {}\n  camera rotation, deg{}\n"
        "  cost (Eq 3), px     {}\n",
        method.method, s.accepted, s.views, s.wrong, wrong_px, method.seconds,
        SpreadText(s.surface_px, 3), SpreadText(s.centre_mm, 3), SpreadText(s.rotation_deg, 4),
        SpreadText(s.cost_px, 3));
    // The paper's method reports no uncertainty.
    if (method.method != "paper")
      text +=
          fmt::format("  centre RMS {:.4g} mm, {:.2f} of the reported sigma; mean NEES {:.2f}\n",
                      s.centre_rms_mm, s.centre_per_sigma, s.mean_nees);
    for (const FreeDirection& free : method.free_directions)
      text += fmt::format("  free: {} of {} about ({:.4f}, {:.4f}, {:.4f}), data sigma {:.3g}\n",
                          free.kind == FreeDirection::Kind::rotation ? "rotation" : "translation",
                          free.of, free.axis.x(), free.axis.y(), free.axis.z(), free.data_sigma);
    if (!per_view) continue;
    for (const ViewFigures& view : method.views)
      text += fmt::format(
          "  {:<12} {:<8} surface {:8.2f} px  centre {:8.2f} mm  rotation {:8.3f} deg  cost {:6.3f}"
          "  L1 {:6.3f}  {}\n",
          view.name, view.accepted ? "accepted" : "rejected", view.turned.surface_rms_px,
          view.turned.centre_mm, DegFromRad(view.turned.rotation_rad), view.cost_px,
          view.cost_l1_px, view.reason);
  }
  return text;
}

}  // namespace scan
