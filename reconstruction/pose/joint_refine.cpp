#include "reconstruction/pose/joint_refine.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "reconstruction/pose/bead_evidence.h"
#include "reconstruction/pose/residual_statistics.h"

namespace scan {
namespace {

constexpr int kEstimates = 2;
constexpr double kBinaryVariance = 1.0 / 12.0;  // px^2, quantisation of a binary mask

ResidualCorrelation EstimateCorrelation(std::span<const ViewFit> fits, double floor_px) {
  std::vector<std::span<const ContourMatch>> matches;
  std::vector<ViewResiduals> views;
  std::vector<double> mm_per_px;
  for (const ViewFit& fit : fits) {
    matches.emplace_back(fit.match.matches);
    if (!fit.evidence) continue;
    const CondensedEvidence& evidence = *fit.evidence;
    views.push_back({evidence.state, fit.match.matches});
    mm_per_px.push_back(evidence.pivot.z() / evidence.state.intrinsics.fl_x);
  }
  ResidualCorrelation correlation{std::max(floor_px, CorrelationLength(matches))};
  if (views.size() < 2) return correlation;
  const auto middle = mm_per_px.begin() + static_cast<std::ptrdiff_t>(mm_per_px.size() / 2);
  std::nth_element(mm_per_px.begin(), middle, mm_per_px.end());
  if (!(*middle > 0)) return correlation;
  correlation.place_mm = correlation.along_px * *middle;
  correlation.between_views =
      CorrelationBetweenViews(views, correlation.place_mm, correlation.along_px);
  return correlation;
}

// Pixels that a view's surface moves at most, about, between two poses.
double MotionPx(const ContourMesh& mesh, const CameraFromModel& a, const CameraFromModel& b,
                const Intrinsics& intrinsics) {
  const Eigen::Vector3d pivot = a * mesh.centre;
  const Vector6d motion = MotionBetween(a, b, pivot);
  const double px_per_mm = intrinsics.fl_x / std::max(pivot.z(), 1.0);
  return px_per_mm * (motion.head<3>().norm() * mesh.radius_mm + motion.segment<2>(3).norm() +
                      std::abs(motion[5]) * mesh.radius_mm / std::max(pivot.z(), 1.0));
}

}  // namespace

double PooledSigma(std::span<const ViewFit> fits) {
  std::vector<double> sigma;
  for (const ViewFit& fit : fits)
    if (fit.sigma_px > 0) sigma.push_back(fit.sigma_px);  // else it took no part
  if (sigma.empty()) return 0;
  std::sort(sigma.begin(), sigma.end());
  return sigma[sigma.size() / 2];
}

RefineResult Continued(const RefineResult& earlier, RefineResult later) {
  later.steps.insert(later.steps.begin(), earlier.steps.begin(), earlier.steps.end());
  return later;
}

ViewFit FitView(const ContourMesh& mesh, const PhotoContour& photo, const ViewState& state,
                double window_px, const ResidualCorrelation& correlation,
                const RefineOptions& options) {
  ViewFit fit;
  const auto samples =
      FindContourSamples(mesh, state.camera_from_model, state.intrinsics, options.spacing_px);
  fit.match = MatchContour(samples, photo, state.mask_bias_px, window_px);
  const double floor = std::sqrt(options.sigma_floor_px * options.sigma_floor_px +
                                 (photo.binary ? kBinaryVariance : 0.0));
  const double spread_px = RobustSigma(fit.match.matches);
  fit.sigma_px = std::max(spread_px, floor);
  EvidenceWeights weights;
  weights.sigma_px = fit.sigma_px;
  weights.correlation_px = correlation.along_px;
  // Added to what the view has of its own: contrasts between views stay as well known as they were,
  // for two of them see the same place but not the same line on it.
  weights.discrepancy_px = std::sqrt(correlation.between_views) * spread_px;
  weights.place_mm = correlation.place_mm;
  fit.evidence = Condense(state, fit.match.matches, state.camera_from_model * mesh.centre, weights);
  fit.beads = photo.beads;
  AddBeads(fit.beads, *fit.evidence);
  return fit;
}

std::vector<ViewFit> FitViews(const ContourMesh& mesh, const RigModel& rig,
                              std::span<const PhotoContour> photos, const std::vector<bool>& use,
                              const RigParameters& parameters, double window_px,
                              const ResidualCorrelation& correlation,
                              const RefineOptions& options) {
  std::vector<ViewFit> fits(photos.size());
  tbb::parallel_for(std::size_t{0}, photos.size(), [&](std::size_t i) {
    if (!use[i]) return;
    const int view = static_cast<int>(i);
    const ViewState state{rig.CameraFromModelOf(parameters, view),
                          rig.IntrinsicsOf(parameters, rig.views()[i].lens),
                          parameters.mask_bias_px};
    fits[i] = FitView(mesh, photos[i], state, window_px, correlation, options);
  });
  return fits;
}

RefineResult RefineJoint(const ContourMesh& mesh, const RigModel& rig,
                         std::span<const PhotoContour> photos, const std::vector<bool>& use,
                         const RigParameters& start, const RefineOptions& options,
                         std::stop_token stop) {
  RefineResult result;
  result.parameters = start;
  double window_px = options.first_window_px;
  result.correlation.along_px = options.correlation_floor_px;
  int estimated = 0;  // times the correlation was estimated; then it stays, so that this converges
  std::vector<std::optional<CondensedEvidence>> evidence(photos.size());
  for (; result.iterations < options.max_iterations && !stop.stop_requested();
       ++result.iterations) {
    result.fits =
        FitViews(mesh, rig, photos, use, result.parameters, window_px, result.correlation, options);
    for (std::size_t i = 0; i < photos.size(); ++i) evidence[i] = result.fits[i].evidence;
    const RigParameters before = result.parameters;
    result.cost = SolveRig(rig, evidence, result.parameters);
    double moved_px = 0;
    for (std::size_t i = 0; i < photos.size(); ++i) {
      if (!use[i]) continue;
      const int view = static_cast<int>(i);
      moved_px = std::max(moved_px, MotionPx(mesh, rig.CameraFromModelOf(before, view),
                                             rig.CameraFromModelOf(result.parameters, view),
                                             rig.nominal_intrinsics(rig.views()[i].lens)));
    }
    result.steps.push_back(
        {result.cost, moved_px, window_px, PooledSigma(result.fits), result.steps.empty()});
    const bool at_last_window = window_px <= options.last_window_px;
    if (at_last_window && estimated < kEstimates) {
      ++estimated;
      result.correlation = EstimateCorrelation(result.fits, options.correlation_floor_px);
    }
    if (at_last_window && moved_px < options.converged_px) {
      result.converged = true;
      break;
    }
    // Half of the way each time, or with the residuals when these fall faster.
    double largest_sigma = 0;
    for (const ViewFit& fit : result.fits) largest_sigma = std::max(largest_sigma, fit.sigma_px);
    window_px = std::max(options.last_window_px,
                         std::min(0.7 * window_px, std::max(6 * largest_sigma, moved_px)));
  }
  result.fits = FitViews(mesh, rig, photos, use, result.parameters, options.last_window_px,
                         result.correlation, options);
  return result;
}

}  // namespace scan
