#include "reconstruction/pose/centred_views.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "reconstruction/pose/rigid_motion.h"
#include "reconstruction/pose/silhouette_raster.h"

namespace scan {
namespace {

// Centroid of the mesh's silhouette, in normalised image units; none where it is not in front.
std::optional<Eigen::Vector2d> CentroidOf(const ContourMesh& mesh, const CameraFromModel& pose) {
  constexpr int kSide = 128;
  constexpr double kRadius = 56;
  const Eigen::Vector3d centre = pose * mesh.centre;
  if (!(centre.z() > mesh.radius_mm)) return std::nullopt;
  const Eigen::Vector2d middle = centre.hnormalized();
  const double scale = kRadius * centre.z() / mesh.radius_mm;
  std::vector<Eigen::Vector2f> pixels;
  pixels.reserve(mesh.mesh.vertices.size());
  for (const Eigen::Vector3d& vertex : mesh.mesh.vertices) {
    const Eigen::Vector2d about = scale * ((pose * vertex).hnormalized() - middle);
    pixels.push_back((about + Eigen::Vector2d::Constant(0.5 * kSide)).cast<float>());
  }
  cv::Mat mask(kSide, kSide, CV_8U, cv::Scalar(0));
  FillTriangles(pixels, mesh.mesh.faces, mask, {.vertices_too = true, .one_side = mesh.closed});
  const cv::Moments moments = cv::moments(mask, true);
  if (moments.m00 < 1) return std::nullopt;
  const Eigen::Vector2d centroid(moments.m10 / moments.m00 + 0.5, moments.m01 / moments.m00 + 0.5);
  return middle + (centroid - Eigen::Vector2d::Constant(0.5 * kSide)) / scale;
}

// The view's own motion (w rad, rho mm) that brings one centroid on the other; zero where the log
// excludes it.
Vector6d MotionToCentre(const ContourMesh& mesh, const PhotoContour& photo,
                        const CameraFromModel& pose, const Intrinsics& in, const RigidSigma& sigma,
                        double reach_px) {
  constexpr double kMostSigmas = 5;
  const double depth_mm = (pose * mesh.centre).z();
  const double by_turn_px = in.fl_x * sigma.rotation_rad;
  const double by_shift_px = in.fl_x * sigma.translation_mm / depth_mm;
  const double sigma_px = std::hypot(by_turn_px, by_shift_px);
  if (photo.touches_border || !(sigma_px > reach_px)) return Vector6d::Zero();
  const auto centroid = CentroidOf(mesh, pose);
  if (!centroid) return Vector6d::Zero();
  const Eigen::Vector3d from = centroid->homogeneous(), to = RayOfPixel(in, photo.centroid);
  if (in.fl_x * (to.hnormalized() - *centroid).norm() > kMostSigmas * sigma_px)
    return Vector6d::Zero();
  const Eigen::Matrix3d whole = Eigen::Quaterniond::FromTwoVectors(from, to).toRotationMatrix();
  Vector6d motion;
  motion.head<3>() = std::pow(by_turn_px / sigma_px, 2) * LogSo3(whole);
  const Eigen::Vector3d turned = ExpSo3(motion.head<3>()) * from;
  motion.tail<3>() = depth_mm * (to / to.z() - turned / turned.z());
  return motion;
}

}  // namespace

RigParameters CentredViews(const ContourMesh& mesh, const RigModel& rig,
                           std::span<const PhotoContour> photos, const std::vector<bool>& use,
                           double reach_px) {
  const RigParameters nominal = rig.Nominal();
  RigParameters centred = nominal;
  tbb::parallel_for(std::size_t{0}, photos.size(), [&](std::size_t i) {
    const RigView& view = rig.views()[i];
    if (!use[i] || !view.logged) return;
    const Vector6d motion =
        MotionToCentre(mesh, photos[i], rig.CameraFromModelOf(nominal, static_cast<int>(i)),
                       rig.nominal_intrinsics(view.lens), view.sigma_camera, reach_px);
    std::copy(motion.begin(), motion.end(), centred.views[i].begin() + 2);
  });
  return centred;
}

}  // namespace scan
