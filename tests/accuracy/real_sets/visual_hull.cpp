#include "tests/accuracy/real_sets/visual_hull.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "reconstruction/surface/surface.h"

namespace scan::test {
namespace {

constexpr int kFiner = 4;     // of the distance picture
constexpr float kFarPx = 40;  // beyond, nothing is told apart

// Signed distance to the outline in px, positive inside, on a picture kFiner times finer.
cv::Mat SignedDistance(const Mask& mask) {
  cv::Mat fine, inside, outside;
  cv::resize(mask.coverage, fine, {}, kFiner, kFiner, cv::INTER_LINEAR);
  const cv::Mat solid = fine >= 128;
  cv::distanceTransform(solid, inside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::distanceTransform(~solid, outside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  // Distances are between pixel centres; the outline lies half a pixel before the other's.
  cv::Mat distance = inside - outside;
  for (int y = 0; y < distance.rows; ++y)
    for (int x = 0; x < distance.cols; ++x) {
      float& d = distance.at<float>(y, x);
      d = std::clamp((d > 0 ? d - 0.5f : d + 0.5f) / kFiner, -kFarPx, kFarPx);
    }
  return distance;
}

float Sample(const cv::Mat& distance, const Eigen::Vector2d& pixel) {
  const double x = pixel.x() * kFiner - 0.5, y = pixel.y() * kFiner - 0.5;
  if (!(x >= 0 && y >= 0 && x < distance.cols - 1 && y < distance.rows - 1)) return -kFarPx;
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  const float u = static_cast<float>(x - i), v = static_cast<float>(y - j);
  const float* upper = distance.ptr<float>(j) + i;
  const float* lower = distance.ptr<float>(j + 1) + i;
  return (1 - v) * ((1 - u) * upper[0] + u * upper[1]) + v * ((1 - u) * lower[0] + u * lower[1]);
}

}  // namespace

Result<TriangleMesh> VisualHull(std::span<const HullView> views, const Eigen::AlignedBox3d& box_mm,
                                double voxel_mm) {
  std::vector<cv::Mat> distances(views.size());
  tbb::parallel_for(std::size_t{0}, views.size(),
                    [&](std::size_t i) { distances[i] = SignedDistance(*views[i].mask); });
  Volume volume;
  for (int a = 0; a < 3; ++a)
    volume.size[a] = static_cast<std::size_t>(box_mm.sizes()[a] / voxel_mm) + 2;
  volume.spacing_mm.setConstant(voxel_mm);
  volume.origin_mm = box_mm.min();
  volume.grey.resize(volume.voxels());
  constexpr float kSurelyOutside = -8;
  tbb::parallel_for(std::size_t{0}, volume.size[2], [&](std::size_t k) {
    for (std::size_t j = 0; j < volume.size[1]; ++j)
      for (std::size_t i = 0; i < volume.size[0]; ++i) {
        const Eigen::Vector3d index(static_cast<double>(i), static_cast<double>(j),
                                    static_cast<double>(k));
        const Eigen::Vector3d point = volume.origin_mm + voxel_mm * index;
        float least = kFarPx;
        for (std::size_t v = 0; v < views.size() && least > kSurelyOutside; ++v)
          if (const auto pixel =
                  Project(views[v].camera.intrinsics, views[v].camera.camera_from_model * point))
            least = std::min(least, Sample(distances[v], *pixel));
        volume.grey[volume.index(i, j, k)] = std::max(least, kSurelyOutside);
      }
  });
  SurfaceOptions options;
  options.segment.threshold = 0;
  options.segment.drop_side_walls = false;
  options.segment.fill_cavities = false;
  options.isosurface.local_threshold = false;
  options.smoothing_iterations = 0;
  options.decimate.faces = 15'000;
  SCAN_TRY(SurfaceResult surface, ExtractSurface(volume, options));
  return std::move(surface.mesh);
}

}  // namespace scan::test
