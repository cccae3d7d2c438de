#include "reconstruction/evaluate/pose_sweep.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "drivers/base/rng.h"
#include "drivers/base/units.h"
#include "reconstruction/evaluate/turntable_trial.h"
#include "reconstruction/pose/nominal_pose.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan {
namespace {

Result<SweepPoint> SolveAt(const PoseTrial& trial, double at, bool priors,
                           const SweepOptions& options, const ProgressFn& progress,
                           std::stop_token stop) {
  JointOptions joint = options.joint;
  joint.no_priors = !priors;
  SCAN_TRY(const Poses poses,
           SolveJoint(trial.mesh, trial.photos, trial.masks, joint, progress, std::move(stop)));
  return SweepPoint{at, priors,
                    Summarise(ScorePoses(trial, poses, poses.free_directions), options.wrong_px)};
}

}  // namespace

void DisplaceLoggedPoses(PoseTrial& trial, const RigidSigma& sigma, std::uint64_t seed) {
  Rng rng(seed);
  for (Photo& photo : trial.photos.photos) {
    const auto nominal = NominalCameraFromTable(trial.photos, photo);
    Vector6d motion;
    for (int k = 0; k < 6; ++k)
      motion[k] = (k < 3 ? sigma.rotation_rad : sigma.translation_mm) * rng.Normal();
    if (!nominal) continue;
    const Eigen::Matrix3d turn = ExpSo3(motion.head<3>());
    photo.camera_from_table =
        CameraFromTable(turn * nominal->rotation(),
                        turn * nominal->translation() + Eigen::Vector3d(motion.tail<3>()));
    photo.sigma_view.rotation_rad = std::hypot(photo.sigma_view.rotation_rad, sigma.rotation_rad);
    photo.sigma_view.translation_mm =
        std::hypot(photo.sigma_view.translation_mm, sigma.translation_mm);
  }
}

Result<std::vector<SweepPoint>> SweepNoise(const PoseTrial& trial, std::span<const double> sigma_px,
                                           const SweepOptions& options, const ProgressFn& progress,
                                           std::stop_token stop) {
  std::vector<SweepPoint> points;
  PoseTrial noisy = trial;
  DrawnMaskOptions masks = options.masks;
  for (const double sigma : sigma_px) {
    masks.noise.sigma_px = sigma;
    DrawMasks(noisy, masks);
    for (const bool priors : {true, false}) {
      SCAN_TRY(const SweepPoint point, SolveAt(noisy, sigma, priors, options, progress, stop));
      points.push_back(point);
    }
  }
  return points;
}

Result<std::vector<SweepPoint>> SweepPriors(const PoseTrial& trial,
                                            std::span<const double> sigma_deg_and_mm,
                                            const SweepOptions& options, const ProgressFn& progress,
                                            std::stop_token stop) {
  std::vector<SweepPoint> points;
  if (sigma_deg_and_mm.empty()) return points;
  PoseTrial drawn = trial;
  DrawMasks(drawn, options.masks);
  SCAN_TRY(const SweepPoint without, SolveAt(drawn, 0, false, options, progress, stop));
  for (const double sigma : sigma_deg_and_mm) {
    PoseTrial displaced = drawn;
    DisplaceLoggedPoses(displaced, {RadFromDeg(sigma), sigma}, options.masks.seed);
    SCAN_TRY(const SweepPoint point, SolveAt(displaced, sigma, true, options, progress, stop));
    points.push_back(point);
    points.push_back(without);
    points.back().at = sigma;
  }
  return points;
}

std::string TableOf(std::span<const SweepPoint> points, const std::string& at) {
  std::string text =
      fmt::format("{:>24}  {:>8} {:>9} {:>6}  {:>10} {:>13} {:>15}\n", at, "logged", "accepted",
                  "wrong", "centre, mm", "rotation, deg", "surface RMS, px");
  for (const SweepPoint& point : points) {
    const MethodSummary& s = point.summary;
    text += fmt::format("{:>24g}  {:>8} {:>4} of {:>2} {:>6}  ", point.at,
                        point.priors ? "used" : "not used", s.accepted, s.views, s.wrong);
    text += s.accepted > 0 ? fmt::format("{:>10.3f} {:>13.4f} {:>15.3f}\n", s.centre_mm.median,
                                         s.rotation_deg.median, s.surface_px.median)
                           : fmt::format("{:>10} {:>13} {:>15}\n", "-", "-", "-");
  }
  return text;
}

}  // namespace scan
