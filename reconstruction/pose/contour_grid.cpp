#include "reconstruction/pose/contour_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scan {
namespace {

constexpr double kCell = 8.0;  // px

int CellOf(double v, int cells) {
  return std::clamp(static_cast<int>(std::floor(v / kCell)), 0, cells - 1);
}

}  // namespace

ContourGrid::ContourGrid(std::vector<GridSegment> segments, int width, int height)
    : segments_(std::move(segments)),
      columns_(std::max(1, static_cast<int>(std::ceil(width / kCell)))),
      rows_(std::max(1, static_cast<int>(std::ceil(height / kCell)))) {
  begin_.assign(static_cast<std::size_t>(columns_) * rows_ + 1, 0);
  const auto for_cells = [&](const GridSegment& s, auto&& visit) {
    const int x0 = CellOf(std::min(s.a.x(), s.b.x()), columns_);
    const int x1 = CellOf(std::max(s.a.x(), s.b.x()), columns_);
    const int y0 = CellOf(std::min(s.a.y(), s.b.y()), rows_);
    const int y1 = CellOf(std::max(s.a.y(), s.b.y()), rows_);
    for (int y = y0; y <= y1; ++y)
      for (int x = x0; x <= x1; ++x) visit(CellAt(x, y));
  };
  for (const auto& s : segments_) for_cells(s, [&](int cell) { ++begin_[cell + 1]; });
  for (std::size_t i = 1; i < begin_.size(); ++i) begin_[i] += begin_[i - 1];
  members_.resize(begin_.back());
  std::vector<std::int32_t> next(begin_.begin(), begin_.end() - 1);
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    for_cells(segments_[i],
              [&](int cell) { members_[next[cell]++] = static_cast<std::int32_t>(i); });
  }
}

void ContourGrid::Walk(const Eigen::Vector2d& from, const Eigen::Vector2d& direction,
                       const Eigen::Vector2d& along, double sign, double window_px,
                       double min_cosine, std::optional<ContourCrossing>& best) const {
  // Amanatides and Woo 1987: the cells in the order in which the line enters them.
  int x = static_cast<int>(std::floor(from.x() / kCell));
  int y = static_cast<int>(std::floor(from.y() / kCell));
  const int step_x = direction.x() > 0 ? 1 : -1, step_y = direction.y() > 0 ? 1 : -1;
  const double infinity = std::numeric_limits<double>::infinity();
  const auto first = [&](double p, double d, int cell, int step) {
    if (std::abs(d) < 1e-12) return infinity;
    return ((cell + (step > 0 ? 1 : 0)) * kCell - p) / d;
  };
  double next_x = first(from.x(), direction.x(), x, step_x);
  double next_y = first(from.y(), direction.y(), y, step_y);
  const double delta_x =
      std::abs(direction.x()) < 1e-12 ? infinity : kCell / std::abs(direction.x());
  const double delta_y =
      std::abs(direction.y()) < 1e-12 ? infinity : kCell / std::abs(direction.y());
  double entered = 0;
  double limit = best ? std::min(window_px, std::abs(best->distance_px)) : window_px;
  while (entered <= limit) {
    if (x >= 0 && y >= 0 && x < columns_ && y < rows_) {
      const int cell = CellAt(x, y);
      for (std::int32_t k = begin_[cell]; k < begin_[cell + 1]; ++k) {
        const GridSegment& s = segments_[members_[k]];
        if (s.normal.dot(along) < min_cosine) continue;
        // from + t direction = a + u (b - a)
        const Eigen::Vector2d edge = s.b - s.a, to = s.a - from;
        const double cross = direction.x() * edge.y() - direction.y() * edge.x();
        if (std::abs(cross) < 1e-14) continue;
        const double t = (to.x() * edge.y() - to.y() * edge.x()) / cross;
        const double u = (to.x() * direction.y() - to.y() * direction.x()) / cross;
        if (t < 0 || t > limit || u < -1e-9 || u > 1 + 1e-9) continue;
        if (t < limit || !best) {
          limit = t;
          best = ContourCrossing{sign * t, members_[k]};
        }
      }
    }
    if (next_x < next_y) {
      entered = next_x;
      next_x += delta_x;
      x += step_x;
    } else {
      entered = next_y;
      next_y += delta_y;
      y += step_y;
    }
  }
}

std::optional<ContourCrossing> ContourGrid::Nearest(const Eigen::Vector2d& from,
                                                    const Eigen::Vector2d& along, double window_px,
                                                    double min_cosine) const {
  std::optional<ContourCrossing> best;
  if (segments_.empty() || !from.allFinite() || !along.allFinite() || std::abs(from.x()) > 1e6 ||
      std::abs(from.y()) > 1e6)
    return best;
  Walk(from, along, along, 1.0, window_px, min_cosine, best);
  Walk(from, -along, along, -1.0, window_px, min_cosine, best);
  return best;
}

}  // namespace scan
