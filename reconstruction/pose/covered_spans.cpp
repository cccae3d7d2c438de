#include "reconstruction/pose/covered_spans.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace scan {
namespace {

// The first of `count` pixels whose centre is not left of v; `count` when there is none.
int FirstCentreIn(double v, int count) {
  if (!(v > 0.5)) return 0;
  if (v > count - 0.5) return count;
  return static_cast<int>(std::ceil(v - 0.5));
}

}  // namespace

void CoveredSpans::AddEdge(const Eigen::Vector2d& a, const Eigen::Vector2d& b, int net) {
  const bool down = b.y() > a.y();
  const Eigen::Vector2d &top = down ? a : b, &bottom = down ? b : a;
  const int first = FirstCentreIn(top.y(), h_), end = FirstCentreIn(bottom.y(), h_);
  if (first >= end || net == 0) return;
  const double slope = (bottom.x() - top.x()) / (bottom.y() - top.y());
  for (int row = first; row < end; ++row)
    crossings_.push_back(
        {row, FirstCentreIn(top.x() + slope * (row + 0.5 - top.y()), w_), down ? -net : net});
}

void CoveredSpans::Finish() {
  const auto rows = static_cast<std::size_t>(h_);
  std::vector<std::uint32_t> first(rows + 1, 0);
  for (const Crossing& crossing : crossings_) ++first[static_cast<std::size_t>(crossing.row) + 1];
  for (std::size_t row = 0; row < rows; ++row) first[row + 1] += first[row];
  std::vector<Crossing> by_row(crossings_.size());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (const Crossing& crossing : crossings_)
    by_row[next[static_cast<std::size_t>(crossing.row)]++] = crossing;
  crossings_ = {};
  first_span_.assign(rows + 1, 0);
  for (std::size_t row = 0; row < rows; ++row) {
    const auto of_row = std::span(by_row).subspan(first[row], first[row + 1] - first[row]);
    std::sort(of_row.begin(), of_row.end(),
              [](const Crossing& p, const Crossing& q) { return p.column < q.column; });
    int faces = 0;
    std::int32_t begin = 0;
    for (std::size_t i = 0; i < of_row.size();) {
      const std::int32_t column = of_row[i].column;
      const bool covered = faces > 0;
      for (; i < of_row.size() && of_row[i].column == column; ++i) faces += of_row[i].more;
      if (!covered && faces > 0) begin = column;
      if (covered && faces <= 0) spans_.push_back({begin, column});
    }
    if (faces > 0) spans_.push_back({begin, w_});
    first_span_[row + 1] = static_cast<std::uint32_t>(spans_.size());
  }
}

bool CoveredSpans::Covered(const Eigen::Vector2d& p) const {
  if (!(p.x() >= 0 && p.y() >= 0 && p.x() < w_ && p.y() < h_)) return false;
  const auto row = static_cast<std::size_t>(p.y());
  const auto column = static_cast<std::int32_t>(p.x());
  for (std::uint32_t i = first_span_[row]; i < first_span_[row + 1]; ++i)
    if (column < spans_[i].end) return column >= spans_[i].begin;
  return false;
}

}  // namespace scan
