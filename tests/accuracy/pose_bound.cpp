#include "tests/accuracy/pose_bound.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "reconstruction/evaluate/fig12.h"
#include "reconstruction/render/rasterise.h"

namespace scan::test {
namespace {

constexpr int kPose = 6, kAll = 7;  // pose; with the mask bias
using Vector7d = Eigen::Matrix<double, kAll, 1>;
using Matrix7d = Eigen::Matrix<double, kAll, kAll>;

// Parameter k of: rotation about `pivot` (rad), translation (mm), camera frame.
CameraFromModel Stepped(const CameraFromModel& pose, const Eigen::Vector3d& pivot, int k,
                        double step) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  if (k < 3)
    turn = Eigen::AngleAxisd(step, Eigen::Vector3d::Unit(k)).toRotationMatrix();
  else
    shift[k - 3] = step;
  return CameraFromModel(turn * pose.rotation(),
                         turn * (pose.translation() - pivot) + pivot + shift);
}

// Outline pieces by cells, to be crossed by short lines.
class Pieces {
 public:
  Pieces(const std::vector<Contour>& contours, double cell_px) : cell_px_(cell_px) {
    for (const Contour& contour : contours) {
      for (std::size_t i = 0; i < contour.points.size(); ++i) {
        const ContourPoint &p = contour.points[i],
                           &q = contour.points[(i + 1) % contour.points.size()];
        cells_[CellOf(0.5 * (p.position + q.position))].push_back(
            {p.position, q.position, p.normal + q.normal});
      }
    }
  }

  // Signed distance from `from` along the unit vector `normal` to the nearest piece that faces the
  // same way, within one cell.
  std::optional<double> Distance(const Eigen::Vector2d& from, const Eigen::Vector2d& normal) const {
    std::optional<double> nearest;
    const auto [cx, cy] = CellOf(from);
    for (int y = cy - 1; y <= cy + 1; ++y) {
      for (int x = cx - 1; x <= cx + 1; ++x) {
        const auto cell = cells_.find({x, y});
        if (cell == cells_.end()) continue;
        for (const Piece& piece : cell->second) {
          if (piece.normal.dot(normal) <= 0) continue;
          // from + t normal = a + u (b - a)
          Eigen::Matrix2d m;
          m << normal, piece.a - piece.b;
          if (std::abs(m.determinant()) < 1e-12) continue;
          const Eigen::Vector2d tu = m.inverse() * (piece.a - from);
          if (tu[1] < 0 || tu[1] > 1 || std::abs(tu[0]) > cell_px_) continue;
          if (!nearest || std::abs(tu[0]) < std::abs(*nearest)) nearest = tu[0];
        }
      }
    }
    return nearest;
  }

 private:
  struct Piece {
    Eigen::Vector2d a, b, normal;
  };
  std::pair<int, int> CellOf(const Eigen::Vector2d& p) const {
    return {static_cast<int>(std::floor(p.x() / cell_px_)),
            static_cast<int>(std::floor(p.y() / cell_px_))};
  }
  double cell_px_;
  std::map<std::pair<int, int>, std::vector<Piece>> cells_;
};

std::vector<Eigen::Vector3d> VisiblePoints(const TriangleMesh& mesh, const PoseOf& camera) {
  constexpr int kWidth = 240;
  const Intrinsics small = Scaled(camera.intrinsics, kWidth,
                                  std::max(1, kWidth * camera.intrinsics.h / camera.intrinsics.w));
  const Raster raster = Rasterise(mesh, camera.camera_from_model, small);
  const auto model_from_camera = camera.camera_from_model.inverse();
  std::vector<Eigen::Vector3d> points;
  for (int y = 0; y < raster.depth_mm.rows; ++y)
    for (int x = 0; x < raster.depth_mm.cols; ++x)
      if (const double z = raster.depth_mm.at<float>(y, x); std::isfinite(z))
        points.push_back(model_from_camera * (z * RayOfPixel(small, {x + 0.5, y + 0.5})));
  return points;
}

// What the camera centre and visible points do, by central differences.
void AddEffects(const TriangleMesh& mesh, const PoseOf& camera, const Eigen::Vector3d& pivot,
                const std::array<double, kPose>& steps, OutlineInformation& information) {
  const auto points = VisiblePoints(mesh, camera);
  std::vector<Eigen::Matrix<double, 2, kPose>> rows(points.size());
  for (int k = 0; k < kPose; ++k) {
    const double h = steps[static_cast<std::size_t>(k)];
    const CameraFromModel up = Stepped(camera.camera_from_model, pivot, k, h),
                          down = Stepped(camera.camera_from_model, pivot, k, -h);
    information.centre.col(k) = (CameraCentre(up) - CameraCentre(down)) / (2 * h);
    for (std::size_t i = 0; i < points.size(); ++i)
      rows[i].col(k) = (Project(camera.intrinsics, up * points[i]).value() -
                        Project(camera.intrinsics, down * points[i]).value()) /
                       (2 * h);
  }
  information.surface.setZero();
  for (const auto& J : rows)
    information.surface += J.transpose() * J / static_cast<double>(rows.size());
}

}  // namespace

OutlineInformation InformationOf(const TriangleMesh& mesh, const PoseOf& camera) {
  OutlineInformation information;
  const Intrinsics& in = camera.intrinsics;
  const Eigen::Vector3d pivot = camera.camera_from_model * MassCentre(mesh);
  double radius_mm = 0;
  for (const auto& v : mesh.vertices)
    radius_mm = std::max(radius_mm, (camera.camera_from_model * v - pivot).norm());
  // Steps that move the outline by a few pixels of a full-size picture, whatever this one's size:
  // small against its features, large against the outline's own error.
  const double step_px = in.w * 2.0 / 3696;
  const double mm = step_px * pivot.z() / in.fl_x;
  const double rad = mm / radius_mm, depth_mm = mm * pivot.z() / radius_mm;
  const std::array<double, kPose> steps{rad, rad, rad, mm, mm, depth_mm};
  const double reach_px = 4 * step_px;

  std::vector<ContourPoint> points;
  double piece_px = 0;
  for (const Contour& contour : TrueOutlines(mesh, camera.camera_from_model, in)) {
    const Contour even = Resampled(contour, 0.5 * step_px);
    points.insert(points.end(), even.points.begin(), even.points.end());
    piece_px += LengthOf(contour);
  }
  if (points.empty()) return information;
  piece_px /= static_cast<double>(points.size());
  std::vector<Vector7d> rows(points.size(), Vector7d::Constant(1.0));
  std::vector<bool> seen(points.size(), true);
  for (int k = 0; k < kPose; ++k) {
    const double h = steps[static_cast<std::size_t>(k)];
    const Pieces up(TrueOutlines(mesh, Stepped(camera.camera_from_model, pivot, k, h), in),
                    reach_px);
    const Pieces down(TrueOutlines(mesh, Stepped(camera.camera_from_model, pivot, k, -h), in),
                      reach_px);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto a = up.Distance(points[i].position, points[i].normal);
      const auto b = down.Distance(points[i].position, points[i].normal);
      seen[i] = seen[i] && a && b;
      if (seen[i]) rows[i][k] = (*a - *b) / (2 * h);
    }
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (seen[i])
      information.outline += rows[i] * rows[i].transpose() * piece_px;
    else
      information.skipped += 1 / static_cast<double>(points.size());
  }
  AddEffects(mesh, camera, pivot, steps, information);
  return information;
}

std::optional<PoseBound> BoundOf(const OutlineInformation& information, const ContourNoise& noise,
                                 double bias_sigma_px) {
  const double variance = noise.sigma_px * noise.sigma_px + (noise.binary ? 1.0 / 12 : 0.0);
  Matrix7d H = information.outline / (variance * noise.correlation_px);
  H(kPose, kPose) += bias_sigma_px > 0 ? 1 / (bias_sigma_px * bias_sigma_px) : 1e12;
  // To a unit diagonal first: rad and mm differ by orders of magnitude.
  const Vector7d scale = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::FullPivLU<Matrix7d> scaled(scale.asDiagonal() * H * scale.asDiagonal());
  if (!scaled.isInvertible()) return std::nullopt;
  const Matrix7d all = scale.asDiagonal() * scaled.inverse() * scale.asDiagonal();
  const Eigen::Matrix<double, kPose, kPose> covariance = all.topLeftCorner<kPose, kPose>();
  return PoseBound{
      std::sqrt((information.centre * covariance * information.centre.transpose()).trace()),
      std::sqrt((information.surface * covariance).trace())};
}

}  // namespace scan::test
