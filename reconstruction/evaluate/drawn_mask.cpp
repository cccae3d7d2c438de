#include "reconstruction/evaluate/drawn_mask.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "drivers/base/rng.h"
#include "reconstruction/render/rasterise.h"

namespace scan {

std::vector<Contour> TrueOutlines(const TriangleMesh& mesh,
                                  const CameraFromModel& camera_from_model, const Intrinsics& in) {
  constexpr int kFineWidth = 7392, kMargin = 4, kSamples = 4, kLongestSide = 16384;
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector3d& v : mesh.vertices)
    if (const auto pixel = Project(in, camera_from_model * v)) box.extend(*pixel);
  if (box.isEmpty()) return {};
  const Eigen::Array2i low = box.min().array().floor().cast<int>() - kMargin;
  const Eigen::Array2i high = box.max().array().ceil().cast<int>() + kMargin;
  const Eigen::Array2i size = high - low;
  const int fine = std::clamp(kFineWidth / in.w, 1, std::max(1, kLongestSide / size.maxCoeff()));
  Intrinsics cut = in;
  cut.cx = fine * (in.cx - low.x());
  cut.cy = fine * (in.cy - low.y());
  cut.fl_x *= fine;
  cut.fl_y *= fine;
  cut.w = fine * size.x();
  cut.h = fine * size.y();
  Mask mask;
  mask.coverage = RasteriseCoverage(mesh, camera_from_model, cut, kSamples);
  std::vector<Contour> contours = ExtractContours(mask);
  for (Contour& contour : contours)
    for (ContourPoint& p : contour.points)
      p.position = p.position / fine + low.matrix().cast<double>();
  return contours;
}

Mask DrawMask(const TriangleMesh& mesh, const PoseOf& camera, const DrawnMaskOptions& options,
              std::size_t view) {
  const Intrinsics& in = camera.intrinsics;
  Mask mask;
  mask.binary = options.noise.binary;
  if (options.noise.displaces()) {
    Rng rng(options.seed * 1000003 + view);
    const auto outlines =
        DisplacedContours(TrueOutlines(mesh, camera.camera_from_model, in), options.noise, rng);
    mask.coverage = CoverageOfContours(outlines, cv::Size(in.w, in.h));
  } else {
    mask.coverage = RasteriseCoverage(mesh, camera.camera_from_model, in, options.samples);
  }
  if (mask.binary) cv::threshold(mask.coverage, mask.coverage, 127, 255, cv::THRESH_BINARY);
  return mask;
}

}  // namespace scan
