#include "reconstruction/pose/score.h"

#include <algorithm>
#include <cmath>

#include "reconstruction/pose/rigid_motion.h"
#include "reconstruction/render/rasterise.h"

namespace scan {
namespace {

// Surface points under every few pixels of a picture reduced to this longest side.
constexpr int kPictureSide = 320;

std::vector<Eigen::Vector3d> VisiblePoints(const TriangleMesh& mesh, const PoseOf& truth) {
  const double scale = std::min(
      1.0, static_cast<double>(kPictureSide) / std::max(truth.intrinsics.w, truth.intrinsics.h));
  const Intrinsics small =
      Scaled(truth.intrinsics, std::max(1, static_cast<int>(scale * truth.intrinsics.w)),
             std::max(1, static_cast<int>(scale * truth.intrinsics.h)));
  const Raster raster = Rasterise(mesh, truth.camera_from_model, small);
  const auto model_from_camera = truth.camera_from_model.inverse();
  std::vector<Eigen::Vector3d> points;
  for (int y = 0; y < raster.face.rows; ++y) {
    for (int x = 0; x < raster.face.cols; ++x) {
      if (raster.face.at<std::int32_t>(y, x) < 0) continue;
      const double z = raster.depth_mm.at<float>(y, x);
      points.push_back(model_from_camera * (z * RayOfPixel(small, {x + 0.5, y + 0.5})));
    }
  }
  return points;
}

}  // namespace

PoseError ScorePose(const TriangleMesh& mesh, const PoseOf& truth, const PoseOf& estimate) {
  PoseError error;
  error.centre_mm =
      (CameraCentre(truth.camera_from_model) - CameraCentre(estimate.camera_from_model)).norm();
  error.rotation_rad =
      AngleBetween(truth.camera_from_model.rotation(), estimate.camera_from_model.rotation());
  std::vector<double> distances;
  double squares = 0;
  for (const Eigen::Vector3d& point : VisiblePoints(mesh, truth)) {
    const auto p = Project(truth.intrinsics, truth.camera_from_model * point);
    const auto q = Project(estimate.intrinsics, estimate.camera_from_model * point);
    if (!p) continue;
    distances.push_back(q ? (*p - *q).norm() : std::hypot(truth.intrinsics.w, truth.intrinsics.h));
    squares += distances.back() * distances.back();
  }
  if (distances.empty()) return error;
  error.surface_rms_px = std::sqrt(squares / static_cast<double>(distances.size()));
  const Spread spread = SpreadOf(std::move(distances));
  error.surface_median_px = spread.median;
  error.surface_p95_px = spread.p95;
  error.surface_max_px = spread.max;
  return error;
}

Spread SpreadOf(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  const double median = n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
  return {median, values[std::min(n - 1, n * 95 / 100)], values.back()};
}

}  // namespace scan
