#include "reconstruction/evaluate/contour_noise.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <utility>

#include "drivers/base/units.h"

namespace scan {
namespace {

constexpr double kStepPx = 0.5;  // between points of a displaced contour
constexpr int kLines = 16;       // of each row of pixels

// White noise convolved with a Gaussian of width a has the autocorrelation exp(-s^2 / 4 a^2), whose
// integral is 2 a sqrt(pi). Cyclic, unit variance.
std::vector<double> CyclicNoise(std::size_t count, double step_px, double correlation_px,
                                Rng& rng) {
  std::vector<double> white(count), noise(count, 0.0);
  for (double& w : white) w = rng.Normal();
  const double width = correlation_px / (2 * std::sqrt(kPi)) / step_px;  // in steps
  const auto reach = static_cast<std::ptrdiff_t>(std::ceil(4 * width));
  const auto n = static_cast<std::ptrdiff_t>(count);
  double squares = 0;
  for (std::ptrdiff_t k = -reach; k <= reach; ++k) {
    const double u = static_cast<double>(k) / width;
    const double weight = std::exp(-0.5 * u * u);
    squares += weight * weight;
    for (std::ptrdiff_t i = 0; i < n; ++i)
      noise[static_cast<std::size_t>(i)] +=
          weight * white[static_cast<std::size_t>((((i + k) % n) + n) % n)];
  }
  for (double& v : noise) v /= std::sqrt(squares);
  return noise;
}

struct LineCrossing {
  double x = 0;
  int turn = 0;  // +1: the specimen begins here, on the way right
};

// Adds the length of [begin, end] within each pixel of a row.
void AddSpan(double begin, double end, std::vector<double>& row) {
  const double width = static_cast<double>(row.size());
  begin = std::clamp(begin, 0.0, width);
  end = std::clamp(end, 0.0, width);
  if (!(end > begin)) return;
  const auto first = static_cast<std::size_t>(begin);
  const auto last = std::min(row.size() - 1, static_cast<std::size_t>(end));
  if (first == last) {
    row[first] += end - begin;
    return;
  }
  row[first] += static_cast<double>(first + 1) - begin;
  for (std::size_t x = first + 1; x < last; ++x) row[x] += 1;
  row[last] += end - static_cast<double>(last);
}

void AddLine(std::vector<LineCrossing>& crossings, std::vector<double>& row) {
  std::sort(crossings.begin(), crossings.end(), [](const LineCrossing& a, const LineCrossing& b) {
    return std::pair(a.x, a.turn) < std::pair(b.x, b.turn);
  });
  int winding = 0;
  double begin = 0;
  for (const LineCrossing& crossing : crossings) {
    const bool was_inside = winding > 0;
    winding += crossing.turn;
    if (!was_inside && winding > 0) begin = crossing.x;
    if (was_inside && winding <= 0) AddSpan(begin, crossing.x, row);
  }
}

}  // namespace

std::vector<Contour> DisplacedContours(std::span<const Contour> contours, const ContourNoise& noise,
                                       Rng& rng) {
  assert(noise.correlation_px > 0);
  std::vector<Contour> displaced;
  for (const Contour& contour : contours) {
    Contour moved = Resampled(contour, kStepPx);
    const double step_px = LengthOf(contour) / static_cast<double>(moved.points.size());
    const std::vector<double> stray =
        CyclicNoise(moved.points.size(), step_px, noise.correlation_px, rng);
    for (std::size_t i = 0; i < moved.points.size(); ++i)
      moved.points[i].position +=
          (noise.bias_px + noise.sigma_px * stray[i]) * moved.points[i].normal;
    displaced.push_back(std::move(moved));
  }
  return displaced;
}

cv::Mat CoverageOfContours(std::span<const Contour> contours, cv::Size size) {
  std::vector<std::vector<LineCrossing>> lines(static_cast<std::size_t>(size.height) * kLines);
  const double last_line = static_cast<double>(lines.size()) - 1;
  for (const Contour& contour : contours) {
    for (std::size_t i = 0; i < contour.points.size(); ++i) {
      const Eigen::Vector2d &p = contour.points[i].position,
                            &q = contour.points[(i + 1) % contour.points.size()].position;
      // Line k lies at y = (k + 1/2) / kLines; those in [upper, lower) are crossed.
      const double from = std::ceil(std::min(p.y(), q.y()) * kLines - 0.5);
      const double to = std::ceil(std::max(p.y(), q.y()) * kLines - 0.5) - 1;
      for (double k = std::max(0.0, from); k <= std::min(to, last_line); ++k) {
        const double t = ((k + 0.5) / kLines - p.y()) / (q.y() - p.y());
        lines[static_cast<std::size_t>(k)].push_back(
            {p.x() + t * (q.x() - p.x()), q.y() < p.y() ? 1 : -1});
      }
    }
  }
  cv::Mat coverage(size, CV_8U, cv::Scalar(0));
  std::vector<double> row(static_cast<std::size_t>(size.width));
  for (int y = 0; y < size.height; ++y) {
    std::fill(row.begin(), row.end(), 0.0);
    for (int line = 0; line < kLines; ++line)
      AddLine(lines[static_cast<std::size_t>(y) * kLines + static_cast<std::size_t>(line)], row);
    std::uint8_t* out = coverage.ptr<std::uint8_t>(y);
    for (int x = 0; x < size.width; ++x)
      out[x] = static_cast<std::uint8_t>(
          std::lround(255 * std::min(1.0, row[static_cast<std::size_t>(x)] / kLines)));
  }
  return coverage;
}

}  // namespace scan
