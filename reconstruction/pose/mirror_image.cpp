#include "reconstruction/pose/mirror_image.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "reconstruction/pose/acceptance.h"
#include "reconstruction/pose/view_start.h"

namespace scan {
namespace {

TriangleMesh MirrorImage(const ContourMesh& mesh) {
  TriangleMesh mirrored = mesh.mesh;
  for (Eigen::Vector3d& v : mirrored.vertices) v.x() = 2 * mesh.centre.x() - v.x();
  for (Face& face : mirrored.faces) std::swap(face[1], face[2]);
  return mirrored;
}

// The pose of the mirror image that a distant camera cannot tell: mirrored once more, in the plane
// through the centre that faces the camera.
CameraFromModel MirroredPose(const CameraFromModel& pose, const Eigen::Vector3d& centre) {
  const Eigen::Vector3d in_camera = pose * centre, sight = in_camera.normalized();
  const Eigen::Matrix3d facing = Eigen::Matrix3d::Identity() - 2 * sight * sight.transpose();
  const Eigen::Matrix3d across = Eigen::Vector3d(-1, 1, 1).asDiagonal();
  const Eigen::Matrix3d rotation = facing * pose.rotation() * across;
  return CameraFromModel(rotation, in_camera - rotation * centre);
}

constexpr const char* kUndecided = "The outlines do not tell the mesh from its mirror image";

struct Nearest {
  ViewState state;
  double sigma_px = 0;
  double matched_px = 0;
};

Nearest NearestPose(const ContourMesh& mesh, const PhotoContour& photo, ViewState state,
                    const RefineOptions& options) {
  state.camera_from_model = RefineView(mesh, photo, state, options);
  const auto samples =
      FindContourSamples(mesh, state.camera_from_model, state.intrinsics, options.spacing_px);
  const MatchResult match =
      MatchContour(samples, photo, state.mask_bias_px, options.first_window_px);
  return {state, std::max(RobustSigma(match.matches), options.sigma_floor_px),
          match.MatchedLength()};
}

MirrorComparison CompareView(const ContourMesh& mesh, const ContourMesh& mirrored,
                             const PosedView& view, const RefineOptions& options) {
  const PhotoContour& photo = *view.photo;
  const Nearest own = NearestPose(mesh, photo, view.state, options);
  ViewState start = view.state;
  start.camera_from_model = MirroredPose(start.camera_from_model, mesh.centre);
  const Nearest other = NearestPose(mirrored, photo, start, options);
  // One scale of residuals for both: that of the nearer.
  const double sigma_px = std::min(own.sigma_px, other.sigma_px);
  const auto misfit = [&](const ContourMesh& of, const Nearest& at) {
    return Misfit(of, photo, at.state, sigma_px, options.correlation_floor_px, options.spacing_px);
  };
  const double as_it_is = misfit(mesh, own), mirror = misfit(mirrored, other);
  const double observations =
      std::min(own.matched_px, other.matched_px) / options.correlation_floor_px;
  return {mirror - as_it_is, std::min(mirror, as_it_is),
          observations * std::log(other.sigma_px / own.sigma_px)};
}

// 1 for the mesh as it is, -1 for its mirror image, 0 where the outlines do not tell. Misfits count
// pieces of outline that find no partner, thin parts above all, and those come and go with the
// noise: of 160 photographs of 462 x 306 whose outlines strayed by 0.5 or 1 px, 16 had the mirror
// image nearer by more than 4.6; none by a tenth of the misfit and with smaller residuals as well.
int Verdict(const MirrorComparison& c) {
  constexpr double kDecided = 4.6;  // 1 to 100
  constexpr double kOfMisfit = 0.1;
  if (std::abs(c.gap) < kDecided || std::abs(c.gap) < kOfMisfit * c.misfit) return 0;
  if (std::abs(c.scale_gap) < kDecided || (c.scale_gap > 0) != (c.gap > 0)) return 0;
  return c.gap > 0 ? 1 : -1;
}

}  // namespace

MirrorComparison CompareWithMirrorImage(const ContourMesh& mesh, std::span<const PosedView> views,
                                        const RefineOptions& refine) {
  MirrorComparison all;
  if (views.empty()) return all;
  const TriangleMesh mirrored_mesh = MirrorImage(mesh);
  const ContourMesh mirrored(mirrored_mesh);
  RefineOptions options = refine;
  options.first_window_px = 24 * UnitPx(refine);
  options.max_iterations = 12;
  options.converged_px = 0.05 * UnitPx(refine);
  std::vector<MirrorComparison> each(views.size());
  tbb::parallel_for(std::size_t{0}, views.size(), [&](std::size_t i) {
    each[i] = CompareView(mesh, mirrored, views[i], options);
  });
  for (const MirrorComparison& one : each) {
    all.gap += one.gap;
    all.misfit += one.misfit;
    all.scale_gap += one.scale_gap;
  }
  return all;
}

std::string MirrorReason(const MirrorComparison& comparison) {
  if (Verdict(comparison) >= 0) return {};
  return fmt::format(
      "the outlines are those of the mesh's mirror image (log-likelihood larger by {:.0f}): the "
      "volume's slices are in reversed order or one of its axes is flipped",
      -comparison.gap);
}

std::string MirrorNote(const MirrorComparison& comparison) {
  if (Verdict(comparison) != 0) return {};
  return fmt::format(
      "{}. Unless the specimen is its own mirror image, see by its colours that the model is not "
      "reversed, or take larger photographs from nearer.",
      kUndecided);
}

bool IsMirrorNote(const std::string& note) { return note.starts_with(kUndecided); }

}  // namespace scan
