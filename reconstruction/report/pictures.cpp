#include "reconstruction/report/pictures.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "reconstruction/render/rasterise.h"

namespace scan {
namespace {

using ContourList = std::vector<std::vector<cv::Point>>;

ContourList ContoursOf(const cv::Mat& mask) {
  cv::Mat binary;
  cv::threshold(mask, binary, 127, 255, cv::THRESH_BINARY);
  ContourList contours;
  cv::findContours(binary, contours, cv::RETR_LIST, cv::CHAIN_APPROX_NONE);
  return contours;
}

// Barycentric coordinates of a model point in a triangle's plane, clamped to the triangle.
Eigen::Vector3d Barycentric(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                            const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d u = b - a, v = c - a, w = p - a;
  const double uu = u.dot(u), uv = u.dot(v), vv = v.dot(v), wu = w.dot(u), wv = w.dot(v);
  const double determinant = uu * vv - uv * uv;
  if (!(determinant > 0)) return {1, 0, 0};
  const double s = std::clamp((vv * wu - uv * wv) / determinant, 0.0, 1.0);
  const double t = std::clamp((uu * wv - uv * wu) / determinant, 0.0, 1.0 - s);
  return {1 - s - t, s, t};
}

cv::Vec3b SampleBilinear(const cv::Mat& picture, double x, double y) {
  const double px = std::clamp(x - 0.5, 0.0, picture.cols - 1.001);
  const double py = std::clamp(y - 0.5, 0.0, picture.rows - 1.001);
  const int i = static_cast<int>(px), j = static_cast<int>(py);
  const double fx = px - i, fy = py - j;
  cv::Vec3d sum(0, 0, 0);
  for (int dj = 0; dj < 2; ++dj)
    for (int di = 0; di < 2; ++di)
      sum += (di ? fx : 1 - fx) * (dj ? fy : 1 - fy) *
             cv::Vec3d(picture.at<cv::Vec3b>(j + dj, i + di));
  return {cv::saturate_cast<uchar>(sum[0]), cv::saturate_cast<uchar>(sum[1]),
          cv::saturate_cast<uchar>(sum[2])};
}

}  // namespace

cv::Size Crop::size() const {
  return {std::max(1, static_cast<int>(std::lround(full_px.width * scale))),
          std::max(1, static_cast<int>(std::lround(full_px.height * scale)))};
}

Crop CropAround(const cv::Mat& mask_a, const cv::Mat& mask_b, int longest_px) {
  cv::Mat either = mask_a > 127;
  either |= mask_b > 127;
  cv::Rect box = cv::boundingRect(either);
  const cv::Rect whole(0, 0, mask_a.cols, mask_a.rows);
  if (box.empty()) box = whole;
  const int margin = 12 + std::max(box.width, box.height) / 25;
  Crop crop;
  crop.full_px =
      cv::Rect(box.x - margin, box.y - margin, box.width + 2 * margin, box.height + 2 * margin) &
      whole;
  crop.scale = std::min(
      1.0, static_cast<double>(longest_px) / std::max(crop.full_px.width, crop.full_px.height));
  return crop;
}

cv::Mat CropOf(const cv::Mat& picture, const Crop& crop) {
  cv::Mat small;
  cv::resize(picture(crop.full_px), small, crop.size(), 0, 0, cv::INTER_AREA);
  return small;
}

Intrinsics CropIntrinsics(const Intrinsics& intrinsics, const Crop& crop) {
  Intrinsics shifted = intrinsics;
  shifted.cx -= crop.full_px.x;
  shifted.cy -= crop.full_px.y;
  shifted.w = crop.full_px.width;
  shifted.h = crop.full_px.height;
  return Scaled(shifted, crop.size().width, crop.size().height);
}

cv::Mat DrawOverlay(const cv::Mat& photo_crop, const cv::Mat& photo_mask_crop,
                    const cv::Mat& model_mask_crop) {
  cv::Mat overlay;
  photo_crop.convertTo(overlay, CV_8U, 0.6);
  cv::Mat photo_line(overlay.size(), CV_8U, cv::Scalar(0));
  cv::Mat model_line(overlay.size(), CV_8U, cv::Scalar(0));
  cv::drawContours(photo_line, ContoursOf(photo_mask_crop), -1, 255, 1);
  cv::drawContours(model_line, ContoursOf(model_mask_crop), -1, 255, 1);
  overlay.setTo(cv::Scalar(80, 255, 80), photo_line);
  overlay.setTo(cv::Scalar(255, 60, 255), model_line);
  overlay.setTo(cv::Scalar(255, 255, 255), photo_line & model_line);
  return overlay;
}

cv::Mat RenderTextured(const AtlasMesh& atlas, const cv::Mat& albedo,
                       const CameraFromModel& camera_from_model, const Intrinsics& intrinsics) {
  assert(albedo.type() == CV_8UC3 && albedo.rows == albedo.cols);
  const Raster raster = Rasterise(atlas.mesh, camera_from_model, intrinsics);
  const auto model_from_camera = camera_from_model.inverse();
  cv::Mat picture(raster.face.size(), CV_8UC3, cv::Scalar(255, 255, 255));
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const int id = raster.face.at<int>(y, x);
      if (id < 0) continue;
      const Face& face = atlas.mesh.faces[static_cast<std::size_t>(id)];
      const Eigen::Vector3d point =
          model_from_camera * Eigen::Vector3d(RayOfPixel(intrinsics, {x + 0.5, y + 0.5}) *
                                              raster.depth_mm.at<float>(y, x));
      const Eigen::Vector3d weight =
          Barycentric(point, atlas.mesh.vertices[face[0]], atlas.mesh.vertices[face[1]],
                      atlas.mesh.vertices[face[2]]);
      const Eigen::Vector2d uv = weight[0] * atlas.uv[face[0]] + weight[1] * atlas.uv[face[1]] +
                                 weight[2] * atlas.uv[face[2]];
      picture.at<cv::Vec3b>(y, x) =
          SampleBilinear(albedo, uv.x() * albedo.cols, uv.y() * albedo.rows);
    }
  }
  return picture;
}

cv::Mat ProvenanceColours(const cv::Mat& provenance) {
  assert(provenance.type() == CV_16UC3);
  // BGR of none, measured, blended, filled, synthesised.
  static const cv::Vec3b kColours[] = {
      {255, 255, 255}, {96, 160, 60}, {200, 190, 80}, {60, 140, 240}, {60, 60, 220}};
  cv::Mat picture(provenance.size(), CV_8UC3);
  for (int y = 0; y < provenance.rows; ++y)
    for (int x = 0; x < provenance.cols; ++x) {
      const auto& texel = provenance.at<cv::Vec3w>(y, x);
      picture.at<cv::Vec3b>(y, x) = kColours[std::min<int>(texel[0], 4)];
    }
  return picture;
}

}  // namespace scan
