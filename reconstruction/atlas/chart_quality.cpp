#include "reconstruction/atlas/chart_quality.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "reconstruction/atlas/cross.h"

namespace scan {
namespace {

using Eigen::Vector2d;

double DoubleUvArea(const ChartMesh& chart, const Face& f) {
  return Cross(chart.uv[f[1]] - chart.uv[f[0]], chart.uv[f[2]] - chart.uv[f[0]]);
}

// Below this share of its true area a face is as good as flipped: it would hold no texel.
constexpr double kLeastAreaShare = 1e-3;

bool IsFlipped(const ChartMesh& chart, const Face& f) {
  const Eigen::Vector3d& a = chart.mesh.vertices[f[0]];
  const double area = (chart.mesh.vertices[f[1]] - a).cross(chart.mesh.vertices[f[2]] - a).norm();
  return !(DoubleUvArea(chart, f) > kLeastAreaShare * area);
}

struct Segment {
  Vector2d a, b;
  std::uint32_t from, to;
  double low_x, high_x;
};

bool Crosses(const Segment& s, const Segment& t) {
  if (s.from == t.from || s.from == t.to || s.to == t.from || s.to == t.to) {
    // Neighbours may only meet in their common point: they must not fold back onto each other.
    const bool onwards = s.to == t.from;
    if (!onwards && t.to != s.from) return false;
    const Vector2d d1 = onwards ? Vector2d(s.b - s.a) : Vector2d(t.b - t.a);
    const Vector2d d2 = onwards ? Vector2d(t.b - t.a) : Vector2d(s.b - s.a);
    return Cross(d1, d2) == 0 && d1.dot(d2) < 0;
  }
  const Vector2d r = s.b - s.a, q = t.b - t.a;
  const double t_a = Cross(r, t.a - s.a), t_b = Cross(r, t.b - s.a);
  const double s_a = Cross(q, s.a - t.a), s_b = Cross(q, s.b - t.a);
  if (std::max(s.a.y(), s.b.y()) < std::min(t.a.y(), t.b.y()) ||
      std::max(t.a.y(), t.b.y()) < std::min(s.a.y(), s.b.y()))
    return false;
  return ((t_a >= 0 && t_b <= 0) || (t_a <= 0 && t_b >= 0)) &&
         ((s_a >= 0 && s_b <= 0) || (s_a <= 0 && s_b >= 0));
}

}  // namespace

std::size_t CountFlipped(const ChartMesh& chart) {
  std::size_t count = 0;
  for (const Face& f : chart.mesh.faces) count += IsFlipped(chart, f);
  return count;
}

void Untangle(ChartMesh& chart) {
  constexpr int kRounds = 20;
  std::vector<char> on_border(chart.uv.size(), 0);
  for (const auto& edge : chart.border) on_border[edge[0]] = on_border[edge[1]] = 1;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<char> moves(chart.uv.size(), 0);
    bool any = false;
    for (const Face& f : chart.mesh.faces) {
      if (!IsFlipped(chart, f)) continue;
      for (const std::uint32_t v : f)
        if (!on_border[v]) moves[v] = any = true;
    }
    if (!any) return;
    std::vector<Vector2d> sum(chart.uv.size(), Vector2d::Zero());
    std::vector<int> count(chart.uv.size(), 0);
    for (const Face& f : chart.mesh.faces)
      for (std::size_t k = 0; k < 3; ++k) {
        if (!moves[f[k]]) continue;
        sum[f[k]] += chart.uv[f[(k + 1) % 3]] + chart.uv[f[(k + 2) % 3]];
        count[f[k]] += 2;
      }
    for (std::size_t v = 0; v < moves.size(); ++v)
      if (moves[v]) chart.uv[v] = sum[v] / count[v];
  }
}

bool BorderCrosses(const ChartMesh& chart) {
  std::vector<Segment> segments;
  for (const auto& [from, to] : chart.border) {
    const Vector2d &a = chart.uv[from], &b = chart.uv[to];
    segments.push_back({a, b, from, to, std::min(a.x(), b.x()), std::max(a.x(), b.x())});
  }
  std::sort(segments.begin(), segments.end(), [](const Segment& s, const Segment& t) {
    if (s.low_x != t.low_x) return s.low_x < t.low_x;
    return s.from < t.from;
  });
  for (std::size_t i = 0; i < segments.size(); ++i)
    for (std::size_t j = i + 1; j < segments.size() && segments[j].low_x <= segments[i].high_x; ++j)
      if (Crosses(segments[i], segments[j])) return true;
  return false;
}

std::vector<FaceStretch> StretchOf(const ChartMesh& chart) {
  std::vector<FaceStretch> result;
  for (const Face& f : chart.mesh.faces) {
    const Vector2d &p0 = chart.uv[f[0]], &p1 = chart.uv[f[1]], &p2 = chart.uv[f[2]];
    const Eigen::Vector3d &q0 = chart.mesh.vertices[f[0]], &q1 = chart.mesh.vertices[f[1]],
                          &q2 = chart.mesh.vertices[f[2]];
    const double double_area = DoubleUvArea(chart, f);
    // Sander, Snyder, Gortler, Hoppe 2001, section 3.
    const Eigen::Vector3d ds =
        (q0 * (p1.y() - p2.y()) + q1 * (p2.y() - p0.y()) + q2 * (p0.y() - p1.y())) / double_area;
    const Eigen::Vector3d dt =
        (q0 * (p2.x() - p1.x()) + q1 * (p0.x() - p2.x()) + q2 * (p1.x() - p0.x())) / double_area;
    const double a = ds.squaredNorm(), b = ds.dot(dt), c = dt.squaredNorm();
    const double root = std::sqrt((a - c) * (a - c) + 4 * b * b);
    result.push_back({std::sqrt(0.5 * (a + c + root)),
                      std::sqrt(std::max(0.0, 0.5 * (a + c - root))),
                      0.5 * (q1 - q0).cross(q2 - q0).norm()});
  }
  return result;
}

double StretchQuantile(std::vector<FaceStretch> stretch, double share) {
  std::sort(stretch.begin(), stretch.end(),
            [](const FaceStretch& x, const FaceStretch& y) { return x.largest > y.largest; });
  double total = 0, above = 0;
  for (const FaceStretch& s : stretch) total += s.area;
  for (const FaceStretch& s : stretch) {
    above += s.area;
    if (above > share * total) return s.largest;
  }
  return stretch.empty() ? 0 : stretch.back().largest;
}

double WastedShare(const ChartMesh& chart, double most) {
  double total = 0, wasted = 0;
  for (const Face& f : chart.mesh.faces) {
    const Eigen::Vector3d& a = chart.mesh.vertices[f[0]];
    const double area = (chart.mesh.vertices[f[1]] - a).cross(chart.mesh.vertices[f[2]] - a).norm();
    const double uv_area = DoubleUvArea(chart, f);
    total += uv_area;
    wasted += std::max(0.0, uv_area - most * area);
  }
  return wasted / total;
}

}  // namespace scan
