#include "reconstruction/specimens/profile.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace scan {

using Eigen::Vector2d;

Profile::Profile(const std::vector<Vector2d>& points, int steps_per_span) {
  assert(points.size() >= 3);
  const auto at = [&](std::size_t k, int shift) -> Vector2d {
    const auto i = static_cast<std::ptrdiff_t>(k) + shift;
    const auto n = static_cast<std::ptrdiff_t>(points.size());
    // Beyond its ends the outline goes on as its mirror image across the axis.
    if (i < 0) return Vector2d(-1, 1).cwiseProduct(points[1]);
    if (i >= n) return Vector2d(-1, 1).cwiseProduct(points[points.size() - 2]);
    return points[static_cast<std::size_t>(i)];
  };
  for (std::size_t k = 0; k + 1 < points.size(); ++k) {
    const Vector2d p0 = at(k, -1), p1 = at(k, 0), p2 = at(k, 1), p3 = at(k, 2);
    for (int s = 0; s < steps_per_span; ++s) {
      const double t = static_cast<double>(s) / steps_per_span;
      Vector2d q = 0.5 * (2 * p1 + t * (p2 - p0) + t * t * (2 * p0 - 5 * p1 + 4 * p2 - p3) +
                          t * t * t * (3 * p1 - p0 - 3 * p2 + p3));
      q.x() = std::max(q.x(), 0.0);
      line_.push_back(q);
    }
  }
  line_.push_back(points.back());
  low_z_ = high_z_ = line_.front().y();
  for (const Vector2d& q : line_) {
    max_radius_ = std::max(max_radius_, q.x());
    low_z_ = std::min(low_z_, q.y());
    high_z_ = std::max(high_z_, q.y());
  }
  constexpr std::size_t kRun = 12;
  for (std::size_t first = 0; first + 1 < line_.size(); first += kRun) {
    Run run{first, std::min(first + kRun, line_.size() - 1), Vector2d::Zero(), 0};
    for (std::size_t k = run.first; k <= run.end; ++k) run.centre += line_[k];
    run.centre /= static_cast<double>(run.end - run.first + 1);
    for (std::size_t k = run.first; k <= run.end; ++k) {
      run.radius = std::max(run.radius, (line_[k] - run.centre).norm());
    }
    runs_.push_back(run);
  }
}

double Profile::SignedDistance(const Eigen::Vector3d& p) const {
  const Vector2d q(std::hypot(p.x(), p.y()), p.z());
  double nearest2 = std::numeric_limits<double>::infinity(), nearest = nearest2;
  bool inside = false;
  for (const Run& run : runs_) {
    const bool level = std::abs(q.y() - run.centre.y()) <= run.radius + 1e-9 &&
                       q.x() <= run.centre.x() + run.radius + 1e-9;
    const bool near = (q - run.centre).norm() - run.radius < nearest;
    if (!level && !near) continue;
    for (std::size_t k = run.first; k < run.end; ++k) {
      const Vector2d &a = line_[k], &b = line_[k + 1];
      const Vector2d ab = b - a, aq = q - a;
      const double t = std::clamp(aq.dot(ab) / ab.squaredNorm(), 0.0, 1.0);
      nearest2 = std::min(nearest2, (aq - t * ab).squaredNorm());
      // Even-odd rule along the ray of rising rho.
      if ((a.y() > q.y()) != (b.y() > q.y()) &&
          q.x() < a.x() + (q.y() - a.y()) / (b.y() - a.y()) * ab.x()) {
        inside = !inside;
      }
    }
    nearest = std::sqrt(nearest2);
  }
  return inside ? -nearest : nearest;
}

}  // namespace scan
