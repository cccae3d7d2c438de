#include "reconstruction/pose/exclude_below.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "reconstruction/pose/nominal_pose.h"

namespace scan {
namespace {

constexpr int kBlock = 2;  // px that share one ray

// Height on the table's z axis at which a ray passes it; `from` and `along` in the table frame.
double HeightAtAxis(const Eigen::Vector3d& from, const Eigen::Vector3d& along) {
  const double across = along.head<2>().squaredNorm();
  if (across < 1e-12) return from.z();  // along the axis: it meets every height
  return from.z() - from.head<2>().dot(along.head<2>()) / across * along.z();
}

}  // namespace

Status ExcludeBelow(const PhotoSet& photos, double height_mm, std::vector<Mask>& masks) {
  if (!std::isfinite(height_mm))
    return BadInput("the height is not a number", "--exclude-below-mm",
                    "give mm above the platter");
  std::vector<CameraFromTable> cameras;
  for (const Photo& photo : photos.photos) {
    const auto camera = NominalCameraFromTable(photos, photo);
    if (!camera)
      return BadInput("the height above the platter is not known without a nominal pose",
                      photo.name, "give ignore pictures instead (import --ignore)");
    cameras.push_back(*camera);
  }
  tbb::parallel_for(std::size_t{0}, masks.size(), [&](std::size_t i) {
    Mask& mask = masks[i];
    if (mask.coverage.empty()) return;
    // Masks may share their pictures with others.
    mask.ignore = mask.ignore.empty() ? cv::Mat(cv::Mat::zeros(mask.coverage.size(), CV_8U))
                                      : mask.ignore.clone();
    const Intrinsics& in = photos.intrinsics(photos.photos[i]);
    const auto table_from_camera = cameras[i].inverse();
    const Eigen::Matrix3d rotation = table_from_camera.rotation();
    const Eigen::Vector3d centre = table_from_camera.translation();
    for (int y = 0; y < mask.ignore.rows; y += kBlock) {
      for (int x = 0; x < mask.ignore.cols; x += kBlock) {
        const Eigen::Vector2d middle(x + 0.5 * kBlock, y + 0.5 * kBlock);
        if (HeightAtAxis(centre, rotation * RayOfPixel(in, middle)) >= height_mm) continue;
        const cv::Rect block =
            cv::Rect(x, y, kBlock, kBlock) & cv::Rect({0, 0}, mask.ignore.size());
        mask.ignore(block).setTo(255);
      }
    }
  });
  return {};
}

}  // namespace scan
