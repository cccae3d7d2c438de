#include "reconstruction/pose/picture_cost.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "reconstruction/pose/silhouette_raster.h"

namespace scan {

namespace {

// Every vertex's pixel; NaN where it is not in front of the camera.
std::vector<Eigen::Vector2f> ProjectAll(const TriangleMesh& mesh,
                                        const CameraFromModel& camera_from_model,
                                        const Intrinsics& in) {
  const Eigen::Vector2f nowhere =
      Eigen::Vector2f::Constant(std::numeric_limits<float>::quiet_NaN());
  const Eigen::Matrix3d rotation = camera_from_model.rotation();
  const Eigen::Vector3d translation = camera_from_model.translation();
  std::vector<Eigen::Vector2f> pixels(mesh.vertices.size(), nowhere);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const Eigen::Vector3d x = rotation * mesh.vertices[i] + translation;
    if (in.has_distortion()) {
      if (const auto pixel = Project(in, x)) pixels[i] = pixel->cast<float>();
    } else if (x.z() > 0) {
      const double inverse_z = 1 / x.z();
      pixels[i] = {static_cast<float>(in.fl_x * x.x() * inverse_z + in.cx),
                   static_cast<float>(in.fl_y * x.y() * inverse_z + in.cy)};
    }
  }
  return pixels;
}

}  // namespace

std::vector<cv::Point> BoundaryPixels(const cv::Mat& mask) {
  std::vector<cv::Point> boundary;
  for (int y = 0; y < mask.rows; ++y) {
    const uchar* row = mask.ptr<uchar>(y);
    const uchar* above = y > 0 ? mask.ptr<uchar>(y - 1) : nullptr;
    const uchar* below = y + 1 < mask.rows ? mask.ptr<uchar>(y + 1) : nullptr;
    // Most rows of a picture are empty.
    const void* found = std::memchr(row, 255, static_cast<std::size_t>(mask.cols));
    if (!found) continue;
    for (int x = static_cast<int>(static_cast<const uchar*>(found) - row); x < mask.cols; ++x) {
      if (!row[x]) continue;
      const bool at_edge = (x > 0 && !row[x - 1]) || (x + 1 < mask.cols && !row[x + 1]) ||
                           (above && !above[x]) || (below && !below[x]);
      if (at_edge) boundary.emplace_back(x, y);
    }
  }
  return boundary;
}

ReducedPicture ReducePicture(const Mask& mask, const Intrinsics& intrinsics, int longest_side) {
  ReducedPicture picture;
  if (mask.coverage.empty()) return picture;
  const double scale =
      std::min(1.0, static_cast<double>(longest_side) / std::max(intrinsics.w, intrinsics.h));
  const int w = std::max(1, static_cast<int>(std::lround(scale * intrinsics.w)));
  const int h = std::max(1, static_cast<int>(std::lround(scale * intrinsics.h)));
  picture.intrinsics = Scaled(intrinsics, w, h);
  cv::Mat reduced;
  cv::resize(mask.coverage, reduced, cv::Size(w, h), 0, 0, cv::INTER_AREA);
  cv::Mat binary = reduced > 127;
  const std::vector<cv::Point> boundary = BoundaryPixels(binary);
  if (boundary.empty()) return picture;
  picture.mask = binary;
  cv::Mat seeds(binary.size(), CV_8U, cv::Scalar(255));
  for (const cv::Point& p : boundary) seeds.at<uchar>(p) = 0;
  cv::distanceTransform(seeds, picture.distance_l1, cv::DIST_L1, 3, CV_32F);
  cv::distanceTransform(seeds, picture.distance_l2, cv::DIST_L2, cv::DIST_MASK_PRECISE, CV_32F);
  return picture;
}

cv::Mat RenderReduced(const TriangleMesh& mesh, const CameraFromModel& camera_from_model,
                      const Intrinsics& reduced) {
  cv::Mat rendered(reduced.h, reduced.w, CV_8U, cv::Scalar(0));
  FillTriangles(ProjectAll(mesh, camera_from_model, reduced), mesh.faces, rendered);
  return rendered;
}

PictureCost CostOfPose(const ReducedPicture& picture, const TriangleMesh& mesh,
                       const CameraFromModel& camera_from_model) {
  const cv::Mat rendered = RenderReduced(mesh, camera_from_model, picture.intrinsics);
  PictureCost cost;
  const std::vector<cv::Point> boundary = BoundaryPixels(rendered);
  if (boundary.empty()) {
    cost.l1_px = cost.l2_px = std::max(rendered.cols, rendered.rows);
    return cost;
  }
  for (const cv::Point& p : boundary) {
    cost.l1_px += picture.distance_l1.at<float>(p);
    cost.l2_px += picture.distance_l2.at<float>(p);
  }
  cost.l1_px /= static_cast<double>(boundary.size());
  cost.l2_px /= static_cast<double>(boundary.size());
  return cost;
}

}  // namespace scan
