#include "reconstruction/pose/start_templates.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "reconstruction/pose/picture_cost.h"
#include "reconstruction/pose/silhouette_raster.h"

namespace scan::start {
namespace {

std::vector<Eigen::Vector2f> Thinned(const std::vector<Eigen::Vector2f>& points, int count) {
  std::vector<Eigen::Vector2f> thin;
  if (points.empty()) return thin;
  for (int i = 0; i < count; ++i)
    thin.push_back(
        points[static_cast<std::size_t>(i) * points.size() / static_cast<std::size_t>(count)]);
  return thin;
}

}  // namespace

Silhouette MakeSilhouette(const std::vector<Eigen::Vector2f>& contour, double root_area,
                          int count) {
  Silhouette s;
  s.root_area = root_area;
  s.points = Thinned(contour, count);
  float reach = 0.1f;
  for (const auto& p : contour) reach = std::max({reach, std::abs(p.x()), std::abs(p.y())});
  reach += static_cast<float>(kClip);
  s.field.scale = 0.5f * kFieldSide / reach;
  cv::Mat seeds(kFieldSide, kFieldSide, CV_8U, cv::Scalar(255));
  for (const auto& p : contour) {
    const int x = static_cast<int>(p.x() * s.field.scale + 0.5f * kFieldSide);
    const int y = static_cast<int>(p.y() * s.field.scale + 0.5f * kFieldSide);
    if (x >= 0 && y >= 0 && x < kFieldSide && y < kFieldSide) seeds.at<uchar>(y, x) = 0;
  }
  cv::Mat distance;
  cv::distanceTransform(seeds, distance, cv::DIST_L2, 3, CV_32F);
  distance.convertTo(s.field.steps, CV_8U, 1.0 / (s.field.scale * kStep));  // saturates
  const double top = kClip / kStep;
  cv::min(s.field.steps, top, s.field.steps);
  return s;
}

Template RenderTemplate(const TriangleMesh& mesh, bool closed, const Eigen::Vector3d& centre,
                        double radius_mm, const Eigen::Vector3d& direction, double distance_mm,
                        int count) {
  Template t;
  const Eigen::Vector3d z = -direction;
  const Eigen::Vector3d x = z.unitOrthogonal();
  t.camera_from_model.row(0) = x.transpose();
  t.camera_from_model.row(1) = z.cross(x).transpose();
  t.camera_from_model.row(2) = z.transpose();
  const double focal =
      0.47 * kSide * std::max(distance_mm - radius_mm, 0.1 * radius_mm) / radius_mm;
  std::vector<Eigen::Vector2f> pixels;
  pixels.reserve(mesh.vertices.size());
  for (const auto& v : mesh.vertices) {
    const Eigen::Vector3d c = t.camera_from_model * (v - centre);
    const double scale = focal / std::max(c.z() + distance_mm, 1e-6);
    pixels.emplace_back(static_cast<float>(0.5 * kSide + scale * c.x()),
                        static_cast<float>(0.5 * kSide + scale * c.y()));
  }
  cv::Mat mask(kSide, kSide, CV_8U, cv::Scalar(0));
  FillTriangles(pixels, mesh.faces, mask,
                {.vertices_too = true, .one_side = closed && distance_mm > radius_mm});
  const cv::Moments moments = cv::moments(mask, true);
  if (moments.m00 < 1) return t;
  const Eigen::Vector2d centroid(moments.m10 / moments.m00 + 0.5, moments.m01 / moments.m00 + 0.5);
  t.centroid = (centroid - Eigen::Vector2d::Constant(0.5 * kSide)) / focal;
  const double root_area = std::sqrt(moments.m00);
  std::vector<Eigen::Vector2f> contour;
  for (const cv::Point& p : BoundaryPixels(mask)) {
    const Eigen::Vector2d about = Eigen::Vector2d(p.x + 0.5, p.y + 0.5) - centroid;
    contour.push_back((about / root_area).cast<float>());
  }
  t.silhouette = MakeSilhouette(contour, root_area / focal, count);
  return t;
}

Silhouette SilhouetteOf(const PhotoContour& photo, const Intrinsics& in, int count,
                        Eigen::Matrix3d& turn) {
  const Eigen::Vector3d axis = RayOfPixel(in, photo.centroid).normalized();
  turn = Eigen::Quaterniond::FromTwoVectors(axis, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const double root_area = std::sqrt(photo.area_px / (in.fl_x * in.fl_y));
  std::vector<Eigen::Vector2f> contour;
  for (const GridSegment& segment : photo.grid.segments()) {
    const Eigen::Vector3d ray = turn * RayOfPixel(in, 0.5 * (segment.a + segment.b));
    contour.push_back((ray.head<2>() / (ray.z() * root_area)).cast<float>());
  }
  return MakeSilhouette(contour, root_area, count);
}

std::vector<Eigen::Vector2f> Rotated(const std::vector<Eigen::Vector2f>& points, double angle) {
  const Eigen::Rotation2Df turn(static_cast<float>(angle));
  std::vector<Eigen::Vector2f> rotated;
  rotated.reserve(points.size());
  for (const auto& p : points) rotated.push_back(turn * p);
  return rotated;
}

float MeanDistance(const DistanceField& field, const std::vector<Eigen::Vector2f>& points) {
  const uchar* steps = field.steps.data;
  const auto side = static_cast<float>(kFieldSide);
  const float middle = 0.5f * side;
  int sum = 0, outside = 0;
  for (const auto& p : points) {
    const float x = p.x() * field.scale + middle, y = p.y() * field.scale + middle;
    if (x >= 0 && y >= 0 && x < side && y < side)
      sum += steps[static_cast<int>(y) * kFieldSide + static_cast<int>(x)];
    else
      ++outside;
  }
  return (kStep * static_cast<float>(sum) + field.clip * static_cast<float>(outside)) /
         static_cast<float>(points.size());
}

}  // namespace scan::start
