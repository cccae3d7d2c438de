#include "reconstruction/pose/silhouette_raster.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace scan {
namespace {

// First pixel whose centre is not left of x: centre i + 0.5 >= x.
int FirstCentre(float x) { return static_cast<int>(std::ceil(x - 0.5f)); }

void FillTriangle(Eigen::Vector2f a, Eigen::Vector2f b, Eigen::Vector2f c, cv::Mat& mask) {
  if (b.y() < a.y()) std::swap(a, b);
  if (c.y() < a.y()) std::swap(a, c);
  if (c.y() < b.y()) std::swap(b, c);
  const int y0 = std::max(0, FirstCentre(a.y()));
  const int y1 = std::min(mask.rows - 1, FirstCentre(c.y()) - 1);
  if (y0 > y1) return;
  const float slope_ac = (c.x() - a.x()) / (c.y() - a.y());
  for (int y = y0; y <= y1; ++y) {
    const float yc = static_cast<float>(y) + 0.5f;
    const float x_long = a.x() + slope_ac * (yc - a.y());
    const float x_short = yc < b.y() ? a.x() + (b.x() - a.x()) * ((yc - a.y()) / (b.y() - a.y()))
                          : c.y() > b.y()
                              ? b.x() + (c.x() - b.x()) * ((yc - b.y()) / (c.y() - b.y()))
                              : b.x();
    const int x0 = std::max(0, FirstCentre(std::min(x_long, x_short)));
    const int x1 = std::min(mask.cols, FirstCentre(std::max(x_long, x_short)));
    if (x0 < x1) std::memset(mask.ptr<uchar>(y) + x0, 255, static_cast<std::size_t>(x1 - x0));
  }
}

}  // namespace

void FillTriangles(std::span<const Eigen::Vector2f> pixels, std::span<const Face> faces,
                   cv::Mat& mask, bool closed_edges) {
  const float limit = 1e6f;
  for (const Face& face : faces) {
    const Eigen::Vector2f& a = pixels[face[0]];
    const Eigen::Vector2f& b = pixels[face[1]];
    const Eigen::Vector2f& c = pixels[face[2]];
    const float largest = std::max({std::abs(a.x()), std::abs(a.y()), std::abs(b.x()),
                                    std::abs(b.y()), std::abs(c.x()), std::abs(c.y())});
    // Written so that NaN fails.
    if (!(largest < limit) || std::isnan(a.x() + b.x() + c.x())) continue;
    FillTriangle(a, b, c, mask);
  }
  if (!closed_edges) return;
  for (const Eigen::Vector2f& p : pixels) {
    if (!(p.x() >= 0 && p.y() >= 0 && p.x() < static_cast<float>(mask.cols) &&
          p.y() < static_cast<float>(mask.rows)))
      continue;
    mask.at<uchar>(static_cast<int>(p.y()), static_cast<int>(p.x())) = 255;
  }
}

}  // namespace scan
