#include "reconstruction/specimens/shape.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>

namespace scan {
namespace {

Part Bounded(const Ellipsoid& e) { return {e, e.centre, e.radii.maxCoeff()}; }

Part Bounded(const RoundCone& c) {
  const double half = 0.5 * (c.b - c.a).norm();
  return {c, 0.5 * (c.a + c.b), half + std::max(c.radius_a, c.radius_b)};
}

double DistanceTo(const Part& part, const Eigen::Vector3d& p) {
  if (const auto* cone = std::get_if<RoundCone>(&part.primitive)) return SignedDistance(*cone, p);
  return SignedDistance(std::get<Ellipsoid>(part.primitive), p);
}

// Parts and groups that cannot change the result are skipped: beyond `limit` a smooth minimum no
// longer sees them.
double GroupDistance(const PartGroup& group, const Eigen::Vector3d& p, double limit) {
  double d = std::numeric_limits<double>::infinity();
  for (const Part& part : group.parts) {
    const double nearest = (p - part.centre).norm() - part.radius;
    if (nearest >= std::min(d, limit + group.blend_mm) + group.blend_mm) continue;
    const double distance = DistanceTo(part, p);
    d = std::isinf(d) ? distance : SmoothMin(d, distance, group.blend_mm);
  }
  return d;
}

}  // namespace

// The nearest point x of the surface satisfies p - x = t x / r^2; t solves sum (r p / (t + r^2))^2
// = 1, a convex falling function left of whose root Newton's method starts (Eberly 2013).
double SignedDistance(const Ellipsoid& e, const Eigen::Vector3d& p) {
  const Eigen::Array3d y = (e.axes.transpose() * (p - e.centre)).array().abs().max(1e-12);
  const Eigen::Array3d r = e.radii.array(), r2 = r * r;
  double t = (r * y - r2).maxCoeff();
  for (int iteration = 0; iteration < 40; ++iteration) {
    const Eigen::Array3d q = 1 / (t + r2);
    const Eigen::Array3d s = (r * y * q).square();
    const double excess = s.sum() - 1;
    const double step = excess / (2 * (s * q).sum());
    t += step;
    if (!(step > 1e-10 * r2.maxCoeff())) break;
  }
  return t * (y / (t + r2)).matrix().norm();
}

double SignedDistance(const RoundCone& c, const Eigen::Vector3d& p) {
  const Eigen::Vector3d axis = c.b - c.a;
  const double length = axis.norm(), taper = c.radius_a - c.radius_b;
  if (length <= std::abs(taper)) {  // one ball holds the other
    return taper > 0 ? (p - c.a).norm() - c.radius_a : (p - c.b).norm() - c.radius_b;
  }
  const Eigen::Vector3d from_a = p - c.a;
  const double along = from_a.dot(axis) / length;
  const double across = std::sqrt(std::max(0.0, from_a.squaredNorm() - along * along));
  // In the half plane of the axis the flank is a line; its normal is (sine, cosine).
  const double sine = taper / length, cosine = std::sqrt(1 - sine * sine);
  const double foot = along * cosine - across * sine;  // along the flank from a's tangent point
  if (foot <= 0) return std::hypot(along, across) - c.radius_a;
  if (foot >= length * cosine) return std::hypot(along - length, across) - c.radius_b;
  return along * sine + across * cosine - c.radius_a;
}

PartGroup& Shape::AddGroup(int material, double blend_mm, double join_blend_mm) {
  groups_.push_back({});
  groups_.back().material = material;
  groups_.back().blend_mm = blend_mm;
  groups_.back().join_blend_mm = join_blend_mm;
  return groups_.back();
}

void Shape::Finish() {
  for (PartGroup& group : groups_) {
    assert(!group.parts.empty());
    Eigen::AlignedBox3d box;
    for (const Part& part : group.parts) {
      box.extend((part.centre.array() - part.radius).matrix());
      box.extend((part.centre.array() + part.radius).matrix());
    }
    group.centre = box.center();
    group.radius = 0;
    for (const Part& part : group.parts) {
      group.radius = std::max(group.radius, (part.centre - group.centre).norm() + part.radius);
    }
    // A blend adds up to a quarter of its support per part; one more support is on the safe side.
    group.radius += group.blend_mm;
  }
}

double Shape::SignedDistance(const Eigen::Vector3d& p) const {
  double d = std::numeric_limits<double>::infinity();
  for (const PartGroup& group : groups_) {
    const double nearest = (p - group.centre).norm() - group.radius;
    if (nearest >= d + group.join_blend_mm) continue;
    const double distance = GroupDistance(group, p, d + group.join_blend_mm);
    d = std::isinf(d) ? distance : SmoothMin(d, distance, group.join_blend_mm);
  }
  return d;
}

int Shape::MaterialAt(const Eigen::Vector3d& p) const {
  double nearest = std::numeric_limits<double>::infinity();
  int material = 0;
  for (const PartGroup& group : groups_) {
    if ((p - group.centre).norm() - group.radius >= nearest) continue;
    const double distance = GroupDistance(group, p, nearest);
    if (distance < nearest) {
      nearest = distance;
      material = group.material;
    }
  }
  return material;
}

BoundingBox Shape::Bounds() const {
  Eigen::AlignedBox3d box;
  for (const PartGroup& group : groups_) {
    const Eigen::Vector3d grown = Eigen::Vector3d::Constant(group.blend_mm);
    for (const Part& part : group.parts) {
      if (const auto* c = std::get_if<RoundCone>(&part.primitive)) {
        const Eigen::Vector3d ra = Eigen::Vector3d::Constant(c->radius_a);
        const Eigen::Vector3d rb = Eigen::Vector3d::Constant(c->radius_b);
        box.extend((c->a - ra).cwiseMin(c->b - rb) - grown);
        box.extend((c->a + ra).cwiseMax(c->b + rb) + grown);
      } else {
        const auto& e = std::get<Ellipsoid>(part.primitive);
        const Eigen::Vector3d half = (e.axes * e.radii.asDiagonal()).rowwise().norm();
        box.extend(e.centre - half - grown);
        box.extend(e.centre + half + grown);
      }
    }
  }
  return {box.min(), box.max()};
}

void Add(PartGroup& group, const Ellipsoid& ellipsoid) {
  group.parts.push_back(Bounded(ellipsoid));
}
void Add(PartGroup& group, const RoundCone& cone) { group.parts.push_back(Bounded(cone)); }

void AddSwept(PartGroup& group, const std::vector<Eigen::Vector3d>& points,
              const std::vector<double>& radii, int steps_per_span) {
  assert(points.size() >= 2 && radii.size() == points.size());
  const auto at = [&](std::ptrdiff_t k) {
    return points[static_cast<std::size_t>(
        std::clamp<std::ptrdiff_t>(k, 0, static_cast<std::ptrdiff_t>(points.size()) - 1))];
  };
  const auto curve = [&](std::ptrdiff_t span, double t) -> Eigen::Vector3d {
    const Eigen::Vector3d p0 = at(span - 1), p1 = at(span), p2 = at(span + 1), p3 = at(span + 2);
    return 0.5 * (2 * p1 + t * (p2 - p0) + t * t * (2 * p0 - 5 * p1 + 4 * p2 - p3) +
                  t * t * t * (3 * p1 - p0 - 3 * p2 + p3));
  };
  for (std::size_t span = 0; span + 1 < points.size(); ++span) {
    for (int s = 0; s < steps_per_span; ++s) {
      const double t0 = static_cast<double>(s) / steps_per_span;
      const double t1 = static_cast<double>(s + 1) / steps_per_span;
      const auto k = static_cast<std::ptrdiff_t>(span);
      const auto radius = [&](double t) {
        return radii[span] + t * (radii[span + 1] - radii[span]);
      };
      Add(group, RoundCone{curve(k, t0), curve(k, t1), radius(t0), radius(t1)});
    }
  }
}

}  // namespace scan
