#include "reconstruction/pose/view_start.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "reconstruction/pose/acceptance.h"
#include "reconstruction/pose/bead_evidence.h"
#include "reconstruction/pose/poses.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan {
namespace {

using namespace start;

// Without a distance: templates hardly change beyond.
constexpr double kFarRadii = 20;

Eigen::Matrix3d PrincipalAxes(const TriangleMesh& mesh, const Eigen::Vector3d& centre) {
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& v : mesh.vertices) moment += (v - centre) * (v - centre).transpose();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(moment).eigenvectors();
}

// A step of Gauss-Newton, held where the contour says nothing.
Vector6d Step(const CondensedEvidence& evidence, double distance_mm) {
  Matrix6d H = evidence.H.topLeftCorner<6, 6>();
  H.diagonal() *= 1 + 1e-6;
  H.diagonal().head<3>().array() += 1.0;  // 1 rad
  H.diagonal().tail<3>().array() += 1 / std::pow(0.2 * distance_mm, 2);
  Vector6d step = -H.ldlt().solve(evidence.g.head<6>());
  constexpr double kLongest_rad = 0.3;
  const double turn = step.head<3>().norm();
  if (turn > kLongest_rad) step *= kLongest_rad / turn;
  return step;
}

double MovedPx(const Vector6d& step, const Eigen::Vector3d& pivot, double radius_mm, double focal) {
  const double z = std::max(pivot.z(), 1.0);
  return focal / z *
         (step.head<3>().norm() * radius_mm + step.segment<2>(3).norm() +
          std::abs(step[5]) * radius_mm / z);
}

bool Alike(const CameraFromModel& a, const CameraFromModel& b, double angle_rad) {
  return AngleBetween(a.rotation(), b.rotation()) < angle_rad;
}

}  // namespace

CameraFromModel RefineView(const ContourMesh& mesh, const PhotoContour& photo,
                           const ViewState& start_state, const RefineOptions& options) {
  constexpr double kLeastObservations = 4;
  ViewState state = start_state;
  double window_px = options.first_window_px;
  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    const auto samples =
        FindContourSamples(mesh, state.camera_from_model, state.intrinsics, options.spacing_px);
    const MatchResult match = MatchContour(samples, photo, state.mask_bias_px, window_px);
    EvidenceWeights weights;
    weights.sigma_px = std::max(RobustSigma(match.matches), options.sigma_floor_px);
    weights.correlation_px = options.correlation_floor_px;
    const Eigen::Vector3d pivot = state.camera_from_model * mesh.centre;
    CondensedEvidence evidence = Condense(state, match.matches, pivot, weights);
    AddBeads(photo.beads, evidence);
    if (evidence.weight < kLeastObservations || !(pivot.z() > mesh.radius_mm)) break;
    const Vector6d step = Step(evidence, pivot.z());
    state.camera_from_model = MovedAbout(state.camera_from_model, step, pivot);
    const double moved_px = MovedPx(step, pivot, mesh.radius_mm, state.intrinsics.fl_x);
    if (window_px <= options.last_window_px && moved_px < options.converged_px) break;
    window_px = std::max(options.last_window_px,
                         std::min(0.7 * window_px, std::max(6 * weights.sigma_px, moved_px)));
  }
  return state.camera_from_model;
}

ViewSearch::ViewSearch(const ContourMesh& mesh, double distance_mm, const StartOptions& search,
                       const ViewStartOptions& options)
    : mesh_(mesh),
      distance_mm_(distance_mm > 0 ? distance_mm : kFarRadii * mesh.radius_mm),
      search_(search),
      options_(options),
      coarse_triangles_(MeshForRoughSteps(mesh)),
      coarse_(coarse_triangles_),
      principal_axes_(PrincipalAxes(mesh.mesh, mesh.centre)) {
  const std::vector<Eigen::Vector3d> directions = IcosphereDirections(search.subdivisions);
  const TriangleMesh small = ClusteredMesh(mesh.mesh, 2 * mesh.radius_mm / kSide);
  templates_.resize(directions.size());
  tbb::parallel_for(std::size_t{0}, directions.size(), [&](std::size_t k) {
    templates_[k] = RenderTemplate(small, mesh.closed, mesh.centre, mesh.radius_mm, directions[k],
                                   distance_mm_, search.points);
  });
}

std::vector<CameraFromModel> ViewSearch::Search(const PhotoContour& photo, const Intrinsics& in,
                                                double distance_mm) const {
  Eigen::Matrix3d turn;
  const Silhouette seen = SilhouetteOf(photo, in, search_.points, turn);
  const auto angles = static_cast<std::size_t>(search_.angles);
  const double step = 2 * kPi / search_.angles;
  const double slack = distance_mm > 0 ? options_.known_slack : options_.unknown_slack;
  std::vector<std::vector<Eigen::Vector2f>> turned_points;
  for (std::size_t a = 0; a < angles; ++a)
    turned_points.push_back(Rotated(seen.points, -static_cast<double>(a) * step));
  std::vector<float> scores(templates_.size() * angles, 1e9f);
  tbb::parallel_for(std::size_t{0}, templates_.size(), [&](std::size_t k) {
    const Silhouette& t = templates_[k].silhouette;
    if (t.points.empty()) return;
    const double expected_mm = distance_mm > 0 ? distance_mm : distance_mm_;
    const double ratio = seen.root_area * expected_mm / (t.root_area * distance_mm_);
    // Without a stated distance every size is possible.
    const double size = distance_mm > 0 ? std::max(0.0, std::abs(std::log(ratio)) - slack) : 0.0;
    for (std::size_t a = 0; a < angles; ++a)
      scores[k * angles + a] =
          MeanDistance(seen.field, Rotated(t.points, static_cast<double>(a) * step)) +
          MeanDistance(t.field, turned_points[a]) + static_cast<float>(std::min(1.0, 0.5 * size));
  });
  std::vector<std::size_t> order(scores.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::size_t looked_at = std::min<std::size_t>(order.size(), 20000);
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(looked_at),
                    order.end(), [&](std::size_t a, std::size_t b) {
                      return std::pair(scores[a], a) < std::pair(scores[b], b);
                    });
  std::vector<CameraFromModel> found;
  for (std::size_t n = 0; n < looked_at; ++n) {
    if (static_cast<int>(found.size()) >= options_.candidates) break;
    const Template& t = templates_[order[n] / angles];
    if (t.silhouette.points.empty()) break;
    const double angle = static_cast<double>(order[n] % angles) * step;
    const Eigen::Matrix3d rotation =
        turn.transpose() * Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
        t.camera_from_model;
    const double size = seen.root_area / t.silhouette.root_area;
    const Eigen::Vector2d offset = Eigen::Rotation2Dd(angle) * (-size * t.centroid);
    const Eigen::Vector3d centre =
        distance_mm_ / size * (turn.transpose() * offset.homogeneous()).normalized();
    const CameraFromModel pose(rotation, centre - rotation * mesh_.centre);
    if (std::none_of(found.begin(), found.end(),
                     [&](const auto& p) { return Alike(p, pose, options_.distinct_rad); }))
      found.push_back(pose);
  }
  return found;
}

std::vector<CameraFromModel> ViewSearch::TwinsOf(const PhotoContour& photo, const Intrinsics& in,
                                                 const CameraFromModel& pose) const {
  const Eigen::Vector3d sight = RayOfPixel(in, photo.centroid).normalized();
  const Eigen::Matrix3d roll = Eigen::AngleAxisd(kPi, sight).toRotationMatrix();
  const Eigen::Vector3d centre = pose * mesh_.centre;
  std::vector<CameraFromModel> twins;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Matrix3d flip = Eigen::AngleAxisd(kPi, principal_axes_.col(k)).toRotationMatrix();
    const Eigen::Matrix3d rotation = roll * pose.rotation() * flip;
    twins.emplace_back(rotation, centre - rotation * mesh_.centre);
  }
  return twins;
}

std::vector<ViewCandidate> ViewSearch::Solve(const PhotoContour& photo, const Intrinsics& in,
                                             double distance_mm, const RefineOptions& refine,
                                             std::stop_token stop) const {
  if (photo.empty() || !(photo.area_px > 0) || stop.stop_requested()) return {};
  const double unit = UnitPx(refine);
  RefineOptions rough = refine;
  rough.first_window_px = std::max(60 * unit, 0.08 * photo.diameter_px);
  rough.last_window_px = 16 * unit;
  rough.spacing_px = 2 * refine.spacing_px;
  rough.max_iterations = 14;
  rough.converged_px = 0.5 * unit;
  const auto refined = [&](const ContourMesh& mesh, const std::vector<CameraFromModel>& starts,
                           const RefineOptions& options, double clip_px) {
    std::vector<ViewCandidate> list(starts.size());
    tbb::parallel_for(std::size_t{0}, starts.size(), [&](std::size_t i) {
      const CameraFromModel pose = RefineView(mesh, photo, {starts[i], in, 0}, options);
      list[i] = {pose, TwoWayDistance(mesh, photo, {pose, in, 0}, clip_px, options.spacing_px)};
    });
    std::stable_sort(list.begin(), list.end(), [](const ViewCandidate& a, const ViewCandidate& b) {
      return a.misfit < b.misfit;
    });
    return list;
  };
  constexpr double kSame_rad = 0.03;
  const auto add = [&](std::vector<CameraFromModel>& to, const CameraFromModel& pose) {
    if (std::none_of(to.begin(), to.end(),
                     [&](const auto& p) { return Alike(p, pose, kSame_rad); }))
      to.push_back(pose);
  };

  // With the coarse mesh right poses of beetle and orchid are 0.5 to 1.8 px off and wrong ones at
  // least 3 times as much, from 5 px on (Fig 12 and bench_pose_speed): the full mesh costs ten
  // times as much, and such a distance it does not make good.
  const auto hopeless = [&](const ViewCandidate& c, const ViewCandidate& best) {
    return c.misfit > 3 * best.misfit + 2 * unit;
  };
  std::vector<CameraFromModel> starts;
  const auto found = refined(coarse_, Search(photo, in, distance_mm), rough, 40 * unit);
  for (const ViewCandidate& c : found) {
    if (static_cast<int>(starts.size()) >= options_.finalists || hopeless(c, found.front())) break;
    add(starts, c.camera_from_model);
  }
  // Twins of all finalists, as many again kept.
  std::vector<CameraFromModel> twins;
  for (const CameraFromModel& pose : starts)
    for (const CameraFromModel& twin : TwinsOf(photo, in, pose)) twins.push_back(twin);
  int kept = 0;
  for (const ViewCandidate& c : refined(coarse_, twins, rough, 40 * unit)) {
    if (kept++ >= options_.finalists || hopeless(c, found.front())) break;
    add(starts, c.camera_from_model);
  }
  if (starts.empty() || stop.stop_requested()) return {};

  RefineOptions fine = refine;
  fine.first_window_px = 24 * unit;
  fine.max_iterations = 12;
  fine.converged_px = 0.05 * unit;
  const auto finals = refined(mesh_, starts, fine, 12 * unit);
  // One scale of residuals for all: that of the best.
  const auto samples =
      FindContourSamples(mesh_, finals.front().camera_from_model, in, refine.spacing_px);
  const double sigma_px = std::max(RobustSigma(MatchContour(samples, photo, 0, 24 * unit).matches),
                                   refine.sigma_floor_px);
  std::vector<ViewCandidate> result;
  for (const ViewCandidate& c : finals) {
    const double misfit = Misfit(mesh_, photo, {c.camera_from_model, in, 0}, sigma_px,
                                 refine.correlation_floor_px, refine.spacing_px);
    if (std::none_of(result.begin(), result.end(), [&](const ViewCandidate& r) {
          return Alike(r.camera_from_model, c.camera_from_model, kSame_rad);
        }))
      result.push_back({c.camera_from_model, misfit});
  }
  std::stable_sort(
      result.begin(), result.end(),
      [](const ViewCandidate& a, const ViewCandidate& b) { return a.misfit < b.misfit; });
  return result;
}

}  // namespace scan
