#include "reconstruction/atlas/pack.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "reconstruction/atlas/cross.h"

namespace scan {
namespace {

using Eigen::Vector2d;

constexpr int kMaxCells = 1024;  // of the bitmap's side

// Rows of bits; bit x of a row is bit x % 64 of word x / 64.
class Bitmap {
 public:
  Bitmap() = default;
  Bitmap(int width, int height)
      : width_(width),
        height_(height),
        words_((width + 63) / 64),
        bits_(static_cast<std::size_t>(words_) * static_cast<std::size_t>(height), 0) {}

  int width() const { return width_; }
  int height() const { return height_; }
  int words() const { return words_; }
  const std::uint64_t* row(int y) const { return bits_.data() + Offset(y); }
  bool Get(int x, int y) const { return (row(y)[x / 64] >> (x % 64)) & 1; }
  void Set(int x, int y) {
    bits_[Offset(y) + static_cast<std::size_t>(x / 64)] |= 1ULL << (x % 64);
  }
  std::size_t Count() const {
    std::size_t count = 0;
    for (const std::uint64_t word : bits_) count += static_cast<std::size_t>(std::popcount(word));
    return count;
  }

 private:
  std::size_t Offset(int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(words_);
  }
  int width_ = 0, height_ = 0, words_ = 0;
  std::vector<std::uint64_t> bits_;
};

// A quarter turn: (x, y) -> (height - y, x) for points, cells alike.
Bitmap Turned(const Bitmap& bitmap) {
  Bitmap turned(bitmap.height(), bitmap.width());
  for (int y = 0; y < bitmap.height(); ++y)
    for (int x = 0; x < bitmap.width(); ++x)
      if (bitmap.Get(x, y)) turned.Set(bitmap.height() - 1 - y, x);
  return turned;
}

std::vector<Vector2d> ConvexHull(std::vector<Vector2d> points) {
  std::sort(points.begin(), points.end(), [](const Vector2d& a, const Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  std::vector<Vector2d> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t floor = hull.size();
    for (const Vector2d& p : points) {
      while (hull.size() >= floor + 2 &&
             Cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

// Turns the chart so that its bounding box is smallest, v down, and moves it to the origin.
void Align(ChartMesh& chart) {
  for (Vector2d& p : chart.uv) p.y() = -p.y();
  const std::vector<Vector2d> hull = ConvexHull(chart.uv);
  Vector2d best_axis = Vector2d::UnitX();
  double best_area = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Vector2d edge = hull[(i + 1) % hull.size()] - hull[i];
    if (!(edge.norm() > 0)) continue;
    const Vector2d axis = edge.normalized(), across(-axis.y(), axis.x());
    double low_x = 1e300, high_x = -1e300, low_y = 1e300, high_y = -1e300;
    for (const Vector2d& p : hull) {
      low_x = std::min(low_x, axis.dot(p));
      high_x = std::max(high_x, axis.dot(p));
      low_y = std::min(low_y, across.dot(p));
      high_y = std::max(high_y, across.dot(p));
    }
    const double area = (high_x - low_x) * (high_y - low_y);
    if (area < best_area * (1 - 1e-9)) {
      best_area = area;
      best_axis = axis;
    }
  }
  Vector2d low = Vector2d::Constant(1e300);
  for (Vector2d& p : chart.uv) {
    p = Vector2d(best_axis.dot(p), Cross(best_axis, p));
    low = low.cwiseMin(p);
  }
  for (Vector2d& p : chart.uv) p -= low;
}

double DistanceToSegment(const Vector2d& q, const Vector2d& a, const Vector2d& b) {
  const Vector2d edge = b - a;
  const double length2 = edge.squaredNorm();
  const double s = length2 > 0 ? std::clamp(edge.dot(q - a) / length2, 0.0, 1.0) : 0.0;
  return (a + s * edge - q).norm();
}

double DistanceToTriangle(const Vector2d& q, const std::array<Vector2d, 3>& t) {
  const double a = Cross(t[1] - t[0], q - t[0]), b = Cross(t[2] - t[1], q - t[1]),
               c = Cross(t[0] - t[2], q - t[2]);
  if ((a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0)) return 0;
  return std::min({DistanceToSegment(q, t[0], t[1]), DistanceToSegment(q, t[1], t[2]),
                   DistanceToSegment(q, t[2], t[0])});
}

// Cells any part of which lies within `margin_cells` of the chart; the chart's origin lies at
// (margin, margin). `cells_per_mm` scales uv.
Bitmap Footprint(const ChartMesh& chart, double cells_per_mm, double margin_cells) {
  Vector2d high = Vector2d::Zero();
  for (const Vector2d& p : chart.uv) high = high.cwiseMax(p);
  const auto cells = [&](double mm) {
    return static_cast<int>(std::ceil(mm * cells_per_mm + 2 * margin_cells + 1e-9));
  };
  Bitmap bitmap(std::max(1, cells(high.x())), std::max(1, cells(high.y())));
  const double reach = margin_cells + std::sqrt(0.5);  // to the middle of a cell
  for (const Face& f : chart.mesh.faces) {
    std::array<Vector2d, 3> t;
    for (std::size_t k = 0; k < 3; ++k)
      t[k] = chart.uv[f[k]] * cells_per_mm + Vector2d::Constant(margin_cells);
    const auto [x0, x1] = std::minmax({t[0].x(), t[1].x(), t[2].x()});
    const auto [y0, y1] = std::minmax({t[0].y(), t[1].y(), t[2].y()});
    const int column_end = std::min(bitmap.width() - 1, static_cast<int>(x1 + reach));
    const int row_end = std::min(bitmap.height() - 1, static_cast<int>(y1 + reach));
    for (int y = std::max(0, static_cast<int>(y0 - reach)); y <= row_end; ++y)
      for (int x = std::max(0, static_cast<int>(x0 - reach)); x <= column_end; ++x)
        if (!bitmap.Get(x, y) && DistanceToTriangle({x + 0.5, y + 0.5}, t) <= reach)
          bitmap.Set(x, y);
  }
  return bitmap;
}

struct Run {
  int first, length;
};

struct RowRuns {
  int row = 0;
  int cells = 0;
  std::vector<Run> runs;
};

// Widest rows first: they rule out most places.
std::vector<RowRuns> RunsOf(const Bitmap& bitmap) {
  std::vector<RowRuns> rows;
  for (int y = 0; y < bitmap.height(); ++y) {
    RowRuns row{y, 0, {}};
    for (int x = 0; x < bitmap.width();) {
      if (!bitmap.Get(x, y)) {
        ++x;
        continue;
      }
      const int first = x;
      while (x < bitmap.width() && bitmap.Get(x, y)) ++x;
      row.runs.push_back({first, x - first});
      row.cells += x - first;
    }
    rows.push_back(std::move(row));
  }
  std::stable_sort(rows.begin(), rows.end(),
                   [](const RowRuns& a, const RowRuns& b) { return a.cells > b.cells; });
  return rows;
}

// Twice as long as the widest bitmap: shifts read zeros beyond its end.
constexpr std::size_t kWords = kMaxCells / 64;
using Row = std::array<std::uint64_t, 2 * kWords>;

// target |= source >> shift (towards lower x)
void OrShifted(Row& target, const Row& source, int shift) {
  const auto whole = static_cast<std::size_t>(shift / 64);
  const int part = shift % 64;
  for (std::size_t w = 0; w < kWords; ++w)
    target[w] |= (source[w + whole] >> part) | (source[w + whole + 1] << 1 << (63 - part));
}

struct Spot {
  int x = -1, y = -1;
  bool found() const { return x >= 0; }
};

// Columns from `first` on.
Row BlockedFrom(int first) {
  Row row{};
  for (int x = first; x < kMaxCells; ++x) row[static_cast<std::size_t>(x / 64)] |= 1ULL << (x % 64);
  return row;
}

bool IsFull(const Row& row) {
  std::uint64_t all = ~0ULL;
  for (std::size_t w = 0; w < kWords; ++w) all &= row[w];
  return all == ~0ULL;
}

// Bit x: any of the cells x .. x + length - 1 of the row is taken.
Row Spread(const Row& row, int length) {
  Row spread = row;
  for (int done = 1; done < length;) {
    const int step = std::min(done, length - done);
    const Row before = spread;
    OrShifted(spread, before, step);
    done += step;
  }
  return spread;
}

// The lowest row from `first_y` on, then the leftmost column, where the chart meets nothing.
Spot FirstFreeSpot(const Bitmap& taken, const Bitmap& chart, const std::vector<RowRuns>& rows,
                   int first_y) {
  const int last_x = taken.width() - chart.width();
  if (last_x < 0) return {};
  const Row outside = BlockedFrom(last_x + 1);
  // Large charts are tried at every few rows only: a rim of a thirtieth of their height at most.
  const int stride = std::max(1, chart.height() / 32);
  for (int y = first_y; y + chart.height() <= taken.height(); y += stride) {
    Row blocked = outside;
    for (const RowRuns& chart_row : rows) {
      Row row{};
      std::copy_n(taken.row(y + chart_row.row), taken.words(), row.begin());
      for (const Run& run : chart_row.runs) OrShifted(blocked, Spread(row, run.length), run.first);
      if (IsFull(blocked)) break;
    }
    for (std::size_t w = 0; w < kWords; ++w)
      if (blocked[w] != ~0ULL) return {static_cast<int>(64 * w) + std::countr_one(blocked[w]), y};
  }
  return {};
}

struct Placement {
  int quarter_turns = 0;
  Spot spot;
  int width = 0, height = 0;  // of the unturned footprint, cells
};

// The turn whose top edge comes lowest; nothing when none fits from `first_y` on.
std::optional<Placement> BestTurn(const Bitmap& taken, const std::array<Bitmap, 4>& turned,
                                  int first_y) {
  std::array<Spot, 4> spots;
  tbb::parallel_for(std::size_t{0}, std::size_t{4}, [&](std::size_t k) {
    spots[k] = FirstFreeSpot(taken, turned[k], RunsOf(turned[k]), first_y);
  });
  std::size_t best = 4;
  const auto rank = [&](std::size_t k) {
    return std::array<int, 3>{spots[k].y + turned[k].height(), spots[k].y, spots[k].x};
  };
  for (std::size_t k = 0; k < 4; ++k)
    if (spots[k].found() && (best == 4 || rank(k) < rank(best))) best = k;
  if (best == 4) return std::nullopt;
  return Placement{static_cast<int>(best), spots[best], turned[0].width(), turned[0].height()};
}

// Charts come in order of size: the rows where the last one of about the same size found nothing
// are not searched again.
struct SearchStart {
  int last_y = 0;
  int size_at_restart = 0;

  int RowFor(int size) {
    if (size_at_restart == 0 || size < 0.8 * size_at_restart) {
      size_at_restart = size;
      last_y = 0;
    }
    return std::max(0, last_y - size / 2);
  }
};

// Empty when the charts do not fit at this scale.
std::vector<Placement> TryScale(const std::vector<ChartMesh>& charts, int cells,
                                double cells_per_mm, double margin_cells) {
  std::vector<Bitmap> footprints(charts.size());
  for (const ChartMesh& chart : charts)
    for (const Vector2d& p : chart.uv)
      if (p.maxCoeff() * cells_per_mm + 2 * margin_cells > cells) return {};
  tbb::parallel_for(std::size_t{0}, charts.size(), [&](std::size_t c) {
    footprints[c] = Footprint(charts[c], cells_per_mm, margin_cells);
  });
  std::vector<std::size_t> sizes;
  for (const Bitmap& footprint : footprints) sizes.push_back(footprint.Count());
  const std::size_t needed = std::accumulate(sizes.begin(), sizes.end(), std::size_t{0});
  if (static_cast<double>(needed) > 0.95 * cells * cells) return {};  // never that tight
  std::vector<std::size_t> order(charts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto reach = [&](std::size_t c) {
    return std::max(footprints[c].width(), footprints[c].height());
  };
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    if (reach(a) != reach(b)) return reach(a) > reach(b);
    if (sizes[a] != sizes[b]) return sizes[a] > sizes[b];
    return a < b;
  });
  Bitmap taken(cells, cells);
  std::vector<Placement> placements(charts.size());
  SearchStart start;
  for (const std::size_t c : order) {
    std::array<Bitmap, 4> turned;
    turned[0] = footprints[c];
    for (std::size_t k = 1; k < 4; ++k) turned[k] = Turned(turned[k - 1]);
    int first_y = start.RowFor(reach(c));
    auto best = BestTurn(taken, turned, first_y);
    if (!best && first_y > 0) best = BestTurn(taken, turned, 0);
    if (!best) return {};
    start.last_y = best->spot.y;
    placements[c] = *best;
    const Bitmap& placed = turned[static_cast<std::size_t>(best->quarter_turns)];
    for (int y = 0; y < placed.height(); ++y)
      for (int x = 0; x < placed.width(); ++x)
        if (placed.Get(x, y)) taken.Set(best->spot.x + x, best->spot.y + y);
  }
  return placements;
}

void Apply(ChartMesh& chart, const Placement& placement, double cells_per_mm, double margin_cells,
           int cells) {
  for (Vector2d& p : chart.uv) {
    Vector2d q = p * cells_per_mm + Vector2d::Constant(margin_cells);
    double width = placement.width, height = placement.height;
    for (int turn = 0; turn < placement.quarter_turns; ++turn) {
      q = Vector2d(height - q.y(), q.x());
      std::swap(width, height);
    }
    p = (q + Vector2d(placement.spot.x, placement.spot.y)) / cells;
  }
}

}  // namespace

Result<double> PackCharts(std::vector<ChartMesh>& charts, const PackOptions& options,
                          const ProgressFn& progress, const std::stop_token& stop) {
  const int cells = std::min(kMaxCells, options.size_px / 2);
  const double texels_per_cell = static_cast<double>(options.size_px) / cells;
  const double margin_cells = 0.5 * options.padding_px / texels_per_cell;
  double area_mm2 = 0;
  for (ChartMesh& chart : charts) {
    Align(chart);
    area_mm2 += SurfaceArea(chart.mesh);
  }
  const double scale_of_full_square = cells / std::sqrt(area_mm2);
  // Each step packs a little looser; doubling steps until it fits, then halving back.
  constexpr double kStep = 0.985;
  const auto scale_at = [&](int step) {
    return scale_of_full_square * std::sqrt(0.92) * std::pow(kStep, step);
  };
  constexpr int kLastStep = 1024;
  int too_large = -1, fits = -1;
  std::vector<Placement> placements;
  for (int step = 8, stride = 4; fits < 0 || fits - too_large > 1;) {
    if (stop.stop_requested()) return Cancelled("atlas packing");
    auto tried = TryScale(charts, cells, scale_at(step), margin_cells);
    if (!tried.empty()) {
      fits = step;
      placements = std::move(tried);
    } else {
      too_large = step;
    }
    Report(progress, "pack", fits < 0 ? 0.3 : 0.7);
    if (fits < 0 && step >= kLastStep)
      return BadInput(fmt::format("{} charts do not fit into the picture", charts.size()),
                      fmt::format("atlas of {} x {}", options.size_px, options.size_px),
                      "ask for a larger atlas, a smaller padding, or decimate the mesh");
    if (fits < 0) {
      step = std::min(kLastStep, step + stride);
      stride *= 2;
    } else {
      step = too_large + (fits - too_large) / 2;
    }
  }
  for (std::size_t c = 0; c < charts.size(); ++c)
    Apply(charts[c], placements[c], scale_at(fits), margin_cells, cells);
  return scale_at(fits) * texels_per_cell;
}

}  // namespace scan
