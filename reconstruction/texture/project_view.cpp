#include "reconstruction/texture/project_view.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "reconstruction/render/rasterise.h"
#include "reconstruction/texture/texture.h"

namespace scan {
namespace {

// CV_8U, non-zero: at least a pixel and a half of specimen around the pixel's centre.
cv::Mat SafelyInside(const Mask& mask) {
  cv::Mat inside = mask.coverage >= 250;
  if (!mask.ignore.empty()) inside.setTo(0, mask.ignore);
  cv::erode(inside, inside, cv::getStructuringElement(cv::MORPH_RECT, {3, 3}), {-1, -1}, 1,
            cv::BORDER_CONSTANT, cv::Scalar(0));
  return inside;
}

struct Seen {
  Eigen::Vector3d point, normal;  // camera frame
  Eigen::Vector2d pixel;
  double cosine = 0;
};

class Projector {
 public:
  Projector(const TriangleMesh& mesh, const ViewToProject& view, double max_incidence_rad)
      : view_(view),
        rotation_(view.camera_from_model.rotation()),
        translation_(view.camera_from_model.translation()),
        least_cosine_(std::cos(max_incidence_rad)),
        depth_(Rasterise(mesh, view.camera_from_model, view.intrinsics).depth_mm),
        inside_(SafelyInside(*view.mask)) {
    for (int i = 0; i < 256; ++i) {
      linear_[i] = LinearOfCodes(Colour16::all(static_cast<std::uint16_t>(257 * i)))[0];
    }
  }

  void Project(const Texels& texels, std::size_t i, Layer& layer) const {
    Seen seen;
    seen.point = rotation_ * texels.position[i].cast<double>() + translation_;
    seen.normal = rotation_ * texels.normal[i].cast<double>();
    if (!(seen.point.z() > 0)) return;
    seen.cosine = -seen.normal.dot(seen.point) / seen.point.norm();
    if (!(seen.cosine > least_cosine_)) return;
    const auto pixel = scan::Project(view_.intrinsics, seen.point);
    if (!pixel) return;
    seen.pixel = *pixel;
    if (!(pixel->x() > 2 && pixel->y() > 2 && pixel->x() < depth_.cols - 2 &&
          pixel->y() < depth_.rows - 2)) {
      return;
    }
    if (!Visible(seen)) return;
    layer.colour[i] = CodesOfLinear(Sample(seen, texels.side_mm[i]));
    layer.cosine[i] = static_cast<float>(std::min(1.0, seen.cosine));
    layer.view[i] = view_.index;
    layer.kind[i] = static_cast<std::uint16_t>(TexelClass::measured);
  }

 private:
  // Compares linear depth with the texel's tangent plane, so that a slope needs no tolerance of its
  // own; what remains is curvature and the mesh's facets.
  bool Visible(const Seen& seen) const {
    const int x = static_cast<int>(seen.pixel.x()), y = static_cast<int>(seen.pixel.y());
    if (!inside_.at<uchar>(y, x)) return false;
    const double fx = view_.intrinsics.fl_x, fy = view_.intrinsics.fl_y;
    const double z = seen.point.z(), footprint_mm = z / fx;
    const double slope = std::sqrt(1 - seen.cosine * seen.cosine) / seen.cosine;
    const double tolerance_mm = footprint_mm * (1.5 + std::min(slope, 6.0));
    const double plane = seen.normal.dot(seen.point);
    for (int j = y - 2; j <= y + 2; ++j) {
      for (int i = x - 2; i <= x + 2; ++i) {
        if (std::abs(i - x) + std::abs(j - y) == 4) continue;  // the corners of 5 x 5
        const float depth = depth_.at<float>(j, i);
        if (std::abs(depth - z) < tolerance_mm) continue;
        const Eigen::Vector3d ray(seen.point.x() / z + (i + 0.5 - seen.pixel.x()) / fx,
                                  seen.point.y() / z + (j + 0.5 - seen.pixel.y()) / fy, 1);
        const double along = seen.normal.dot(ray);
        const double expected = along < 0 ? plane / along : z;
        if (depth < expected - tolerance_mm) return false;
        const bool beside = std::abs(i - x) <= 1 && std::abs(j - y) <= 1;
        if (beside && depth > expected + 3 * tolerance_mm) return false;
      }
    }
    return true;
  }

  cv::Vec3f Bilinear(double px, double py) const {
    const double x = px - 0.5, y = py - 0.5;
    const int ix = std::clamp(static_cast<int>(std::floor(x)), 0, view_.photo.cols - 2);
    const int iy = std::clamp(static_cast<int>(std::floor(y)), 0, view_.photo.rows - 2);
    const auto fx = static_cast<float>(x - ix), fy = static_cast<float>(y - iy);
    const auto* r0 = view_.photo.ptr<cv::Vec3b>(iy) + ix;
    const auto* r1 = view_.photo.ptr<cv::Vec3b>(iy + 1) + ix;
    cv::Vec3f out;
    for (int c = 0; c < 3; ++c) {
      out[c] = (1 - fy) * ((1 - fx) * linear_[r0[0][c]] + fx * linear_[r0[1][c]]) +
               fy * ((1 - fx) * linear_[r1[0][c]] + fx * linear_[r1[1][c]]);
    }
    return out;
  }

  // Mean over the texel's square where that is larger than a pixel.
  cv::Vec3f Sample(const Seen& seen, double side_mm) const {
    const double side_px = side_mm * view_.intrinsics.fl_x / seen.point.z();
    const int k = std::clamp(static_cast<int>(std::lround(side_px)), 1, 8);
    if (k == 1) return Bilinear(seen.pixel.x(), seen.pixel.y());
    cv::Vec3f sum(0, 0, 0);
    int count = 0;
    for (int j = 0; j < k; ++j) {
      for (int i = 0; i < k; ++i) {
        const double x = seen.pixel.x() + ((i + 0.5) / k - 0.5) * side_px;
        const double y = seen.pixel.y() + ((j + 0.5) / k - 0.5) * side_px;
        if (x < 0 || y < 0 || x >= inside_.cols || y >= inside_.rows) continue;
        if (!inside_.at<uchar>(static_cast<int>(y), static_cast<int>(x))) continue;
        sum += Bilinear(x, y);
        ++count;
      }
    }
    return count ? sum * (1.f / static_cast<float>(count))
                 : Bilinear(seen.pixel.x(), seen.pixel.y());
  }

  const ViewToProject& view_;
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d translation_;
  double least_cosine_;
  cv::Mat depth_, inside_;
  std::array<float, 256> linear_{};
};

}  // namespace

Layer ProjectView(const Texels& texels, const TriangleMesh& mesh, const ViewToProject& view,
                  double max_incidence_rad) {
  Layer layer = MakeLayer(texels.size());
  const Projector projector(mesh, view, max_incidence_rad);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, texels.size(), 4096),
                    [&](const auto& range) {
                      for (std::size_t i = range.begin(); i < range.end(); ++i)
                        projector.Project(texels, i, layer);
                    });
  return layer;
}

}  // namespace scan
