#include "reconstruction/pose/silhouette_raster.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

namespace scan {
namespace {

constexpr float kLimit = 1e6f;  // px; nothing beyond is drawn

// std::ceil is a library call on machines of the baseline; this is two instructions.
int CeilOf(float v) {
  const int i = static_cast<int>(v);
  return i + (v > static_cast<float>(i) ? 1 : 0);
}

// First pixel whose centre is not left of x: centre i + 0.5 >= x.
int FirstCentre(float x) { return CeilOf(x - 0.5f); }

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

// The first pixel centre right of and below a vertex; a triangle covers no centre when its three
// vertices share a row or a column of them.
struct FirstPixel {
  int x = 0, y = 0;
  bool drawn = false;
};

std::vector<FirstPixel> FirstPixels(std::span<const Eigen::Vector2f> pixels) {
  std::vector<FirstPixel> first(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const Eigen::Vector2f& p = pixels[i];
    // Written so that NaN fails.
    if (!(std::abs(p.x()) < kLimit && std::abs(p.y()) < kLimit)) continue;
    first[i] = {FirstCentre(p.x()), FirstCentre(p.y()), true};
  }
  return first;
}

// At most four pixels that are covered already: most of the faces of a fine mesh in a small
// picture.
bool CoveredAlready(const cv::Mat& mask, int x0, int x1, int y0, int y1) {
  if (x1 - x0 > 2 || y1 - y0 > 2 || x0 < 0 || y0 < 0 || x1 > mask.cols || y1 > mask.rows)
    return false;
  for (int y = y0; y < y1; ++y) {
    const uchar* row = mask.ptr<uchar>(y);
    for (int x = x0; x < x1; ++x)
      if (!row[x]) return false;
  }
  return true;
}

bool RunsClockwise(const Eigen::Vector2f& a, const Eigen::Vector2f& b, const Eigen::Vector2f& c) {
  const float abx = b.x() - a.x(), aby = b.y() - a.y();
  const float acx = c.x() - a.x(), acy = c.y() - a.y();
  return abx * acy - aby * acx > 0;  // rows run down
}

}  // namespace

void FillTriangles(std::span<const Eigen::Vector2f> pixels, std::span<const Face> faces,
                   cv::Mat& mask, const FillOptions& options) {
  const std::vector<FirstPixel> first = FirstPixels(pixels);
  for (const Face& face : faces) {
    const FirstPixel &a = first[face[0]], &b = first[face[1]], &c = first[face[2]];
    // One branch: which of the conditions holds cannot be predicted.
    const bool rows = ((a.y ^ b.y) | (a.y ^ c.y)) != 0, columns = ((a.x ^ b.x) | (a.x ^ c.x)) != 0;
    const bool facing =
        !options.one_side | RunsClockwise(pixels[face[0]], pixels[face[1]], pixels[face[2]]);
    if (!(facing & rows & columns & a.drawn & b.drawn & c.drawn)) continue;
    const auto [x0, x1] = std::minmax({a.x, b.x, c.x});
    const auto [y0, y1] = std::minmax({a.y, b.y, c.y});
    if (CoveredAlready(mask, x0, x1, y0, y1)) continue;
    FillTriangle(pixels[face[0]], pixels[face[1]], pixels[face[2]], mask);
  }
  if (!options.vertices_too) return;
  for (const Eigen::Vector2f& p : pixels) {
    if (!(p.x() >= 0 && p.y() >= 0 && p.x() < static_cast<float>(mask.cols) &&
          p.y() < static_cast<float>(mask.rows)))
      continue;
    mask.at<uchar>(static_cast<int>(p.y()), static_cast<int>(p.x())) = 255;
  }
}

}  // namespace scan
