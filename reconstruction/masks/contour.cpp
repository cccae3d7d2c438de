#include "reconstruction/masks/contour.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace scan {
namespace {

constexpr double kLevel = 127.5;

// The coverage with one ring of background, so that every contour closes. Node (x, y) of the grid
// is the pixel (x - 1, y - 1).
struct Grid {
  cv::Mat values;
  int width() const { return values.cols; }
  int height() const { return values.rows; }
  int node(int x, int y) const { return y * width() + x; }
  // Edges of the grid: 2 * node leads to the right, 2 * node + 1 leads down.
  Eigen::Vector2d Crossing(std::int32_t edge) const {
    const int node_index = edge / 2, x = node_index % width(), y = node_index / width();
    const bool down = edge % 2 != 0;
    const double a = values.at<uchar>(y, x);
    const double b = down ? values.at<uchar>(y + 1, x) : values.at<uchar>(y, x + 1);
    const double t = (kLevel - a) / (b - a);
    return {x - 0.5 + (down ? 0 : t), y - 0.5 + (down ? t : 0)};
  }
};

// next[edge] = the edge that the contour crosses after `edge`, -1 where it does not pass.
std::vector<std::int32_t> LinkSegments(const Grid& grid, std::vector<std::int32_t>& starts) {
  std::vector<std::int32_t> next(2 * grid.values.total(), -1);
  for (int y = 0; y + 1 < grid.height(); ++y) {
    const uchar* row0 = grid.values.ptr<uchar>(y);
    const uchar* row1 = grid.values.ptr<uchar>(y + 1);
    for (int x = 0; x + 1 < grid.width(); ++x) {
      const int a = row0[x], b = row0[x + 1], c = row1[x + 1], d = row1[x];
      // Bits clockwise on the screen from the top left.
      const int code = (a > kLevel) | (b > kLevel) << 1 | (c > kLevel) << 2 | (d > kLevel) << 3;
      if (code == 0 || code == 15) continue;
      const std::int32_t top = 2 * grid.node(x, y), left = top + 1;
      const std::int32_t right = 2 * grid.node(x + 1, y) + 1, bottom = 2 * grid.node(x, y + 1);
      auto link = [&](std::int32_t from, std::int32_t to) {
        next[from] = to;
        starts.push_back(from);
      };
      const bool joined = a + b + c + d >= 4 * kLevel;
      switch (code) {  // the specimen to the right of the direction of travel, y down
        case 1:
          link(top, left);
          break;
        case 2:
          link(right, top);
          break;
        case 3:
          link(right, left);
          break;
        case 4:
          link(bottom, right);
          break;
        case 5:
          joined ? (link(top, right), link(bottom, left)) : (link(top, left), link(bottom, right));
          break;
        case 6:
          link(bottom, top);
          break;
        case 7:
          link(bottom, left);
          break;
        case 8:
          link(left, bottom);
          break;
        case 9:
          link(top, bottom);
          break;
        case 10:
          joined ? (link(left, top), link(right, bottom)) : (link(right, top), link(left, bottom));
          break;
        case 11:
          link(right, bottom);
          break;
        case 12:
          link(left, right);
          break;
        case 13:
          link(top, right);
          break;
        case 14:
          link(left, top);
          break;
      }
    }
  }
  return next;
}

double SignedArea(const Contour& contour) {
  double twice = 0;
  const std::size_t n = contour.points.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d& p = contour.points[i].position;
    const Eigen::Vector2d& q = contour.points[(i + 1) % n].position;
    twice += p.x() * q.y() - q.x() * p.y();
  }
  return 0.5 * twice;
}

// Normals from the chord that spans `half_px` of arc length on either side: follows one side of a
// thin leg and never mixes the two, unlike the gradient of a blurred mask.
void SetNormals(Contour& contour, double half_px) {
  const std::size_t n = contour.points.size();
  std::vector<double> arc(2 * n + 1, 0.0);
  for (std::size_t i = 0; i < 2 * n; ++i) {
    arc[i + 1] =
        arc[i] + (contour.points[(i + 1) % n].position - contour.points[i % n].position).norm();
  }
  const double length = arc[n];
  half_px = std::min(half_px, 0.2 * length);
  // Position at arc length s of the doubled polyline; `hint` moves forward only.
  auto at = [&](double s, std::size_t& hint) -> Eigen::Vector2d {
    while (hint + 1 < 2 * n && arc[hint + 1] < s) ++hint;
    const double step = arc[hint + 1] - arc[hint];
    const double t = step > 0 ? (s - arc[hint]) / step : 0;
    return (1 - t) * contour.points[hint % n].position +
           t * contour.points[(hint + 1) % n].position;
  };
  std::size_t ahead = 0, behind = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double s = arc[i];
    const Eigen::Vector2d chord = at(s + half_px, ahead) - at(s - half_px + length, behind);
    // `behind` runs up to one turn ahead of s, so both hints only ever grow.
    const Eigen::Vector2d outward(chord.y(), -chord.x());  // to the left of travel on the screen
    const double norm = outward.norm();
    contour.points[i].normal = norm > 0 ? Eigen::Vector2d(outward / norm) : Eigen::Vector2d(1, 0);
  }
}

cv::Mat NearIgnored(const cv::Mat& ignore, double radius_px) {
  cv::Mat near;
  if (ignore.empty()) return near;
  const int r = std::max(0, static_cast<int>(std::ceil(radius_px)));
  cv::dilate(ignore != 0, near,
             cv::getStructuringElement(cv::MORPH_ELLIPSE, cv::Size(2 * r + 1, 2 * r + 1)));
  return near;
}

void SetFlags(Contour& contour, const cv::Size& size, const cv::Mat& near_ignored, double cut_px) {
  for (ContourPoint& point : contour.points) {
    const Eigen::Vector2d& p = point.position;
    point.flags = 0;
    if (p.x() < cut_px || p.y() < cut_px || p.x() > size.width - cut_px ||
        p.y() > size.height - cut_px) {
      point.flags |= kContourCut;
    }
    if (!near_ignored.empty()) {
      const int x = std::clamp(static_cast<int>(std::floor(p.x())), 0, size.width - 1);
      const int y = std::clamp(static_cast<int>(std::floor(p.y())), 0, size.height - 1);
      if (near_ignored.at<uchar>(y, x)) point.flags |= kContourIgnored;
    }
  }
}

}  // namespace

std::vector<Contour> ExtractContours(const Mask& mask, const ContourOptions& options) {
  std::vector<Contour> contours;
  if (mask.coverage.empty()) return contours;
  assert(mask.coverage.type() == CV_8U);
  assert(mask.ignore.empty() ||
         (mask.ignore.type() == CV_8U && mask.ignore.size() == mask.coverage.size()));
  Grid grid;
  cv::copyMakeBorder(mask.coverage, grid.values, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  std::vector<std::int32_t> starts;
  std::vector<std::int32_t> next = LinkSegments(grid, starts);
  const cv::Mat near_ignored = NearIgnored(mask.ignore, options.ignore_px);
  for (const std::int32_t start : starts) {
    if (next[start] < 0) continue;
    Contour contour;
    for (std::int32_t edge = start; next[edge] >= 0;) {
      contour.points.push_back({grid.Crossing(edge), Eigen::Vector2d::Zero(), 0});
      edge = std::exchange(next[edge], -1);
    }
    if (contour.points.size() < 3 || LengthOf(contour) < options.min_length_px) continue;
    contour.hole = SignedArea(contour) < 0;
    SetNormals(contour, options.normal_px * (mask.binary ? 2 : 1));
    SetFlags(contour, mask.coverage.size(), near_ignored, options.cut_px);
    contours.push_back(std::move(contour));
  }
  return contours;
}

double LengthOf(const Contour& contour) {
  double length = 0;
  const std::size_t n = contour.points.size();
  for (std::size_t i = 0; i < n; ++i) {
    length += (contour.points[(i + 1) % n].position - contour.points[i].position).norm();
  }
  return length;
}

Contour Resampled(const Contour& contour, double spacing_px) {
  assert(spacing_px > 0);
  const std::size_t n = contour.points.size();
  const double length = LengthOf(contour);
  if (n < 3 || !(length > 0)) return contour;
  const auto count =
      std::max<std::size_t>(3, static_cast<std::size_t>(std::lround(length / spacing_px)));
  Contour out;
  out.hole = contour.hole;
  out.points.reserve(count);
  double arc = 0;
  std::size_t i = 0;
  double step = (contour.points[1].position - contour.points[0].position).norm();
  for (std::size_t k = 0; k < count; ++k) {
    const double s = length * static_cast<double>(k) / static_cast<double>(count);
    while (arc + step < s && i + 1 < n) {
      arc += step;
      ++i;
      step = (contour.points[(i + 1) % n].position - contour.points[i].position).norm();
    }
    const ContourPoint& p = contour.points[i];
    const ContourPoint& q = contour.points[(i + 1) % n];
    const double t = step > 0 ? std::min(1.0, (s - arc) / step) : 0;
    const Eigen::Vector2d normal = (1 - t) * p.normal + t * q.normal;
    const double norm = normal.norm();
    out.points.push_back({(1 - t) * p.position + t * q.position,
                          norm > 1e-9 ? Eigen::Vector2d(normal / norm) : p.normal,
                          static_cast<std::uint8_t>(p.flags | q.flags)});
  }
  return out;
}

}  // namespace scan
