#include "reconstruction/specimens/shape.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "drivers/base/rng.h"
#include "drivers/base/units.h"

namespace scan {
namespace {

using Eigen::Vector3d;

Vector3d RandomVector(Rng& rng, double sigma) {
  return sigma * Vector3d(rng.Normal(), rng.Normal(), rng.Normal());
}

TEST(Ellipsoid, DistanceIsTheNearestPointOfTheSurface) {
  Rng rng(2);
  const Ellipsoid e{{1, 2, 3},
                    {4, 2, 0.7},
                    Eigen::AngleAxisd(0.7, Vector3d(1, 1, 0).normalized()).toRotationMatrix()};
  for (int trial = 0; trial < 40; ++trial) {
    const Vector3d p = e.centre + RandomVector(rng, 2.5);
    double nearest = 1e9;
    for (int i = 0; i < 400; ++i) {
      for (int j = 0; j < 800; ++j) {
        const double u = kPi * i / 399, v = 2 * kPi * j / 800;
        const Vector3d unit(std::sin(u) * std::cos(v), std::sin(u) * std::sin(v), std::cos(u));
        nearest = std::min(nearest, (e.centre + e.axes * e.radii.cwiseProduct(unit) - p).norm());
      }
    }
    const double k = (e.axes.transpose() * (p - e.centre)).cwiseQuotient(e.radii).norm();
    EXPECT_NEAR(SignedDistance(e, p), k < 1 ? -nearest : nearest, 0.02);
  }
  EXPECT_NEAR(SignedDistance(e, e.centre), -0.7, 2e-5);
}

TEST(RoundCone, DistanceIsThatOfItsBalls) {
  Rng rng(3);
  const RoundCone c{{0, 0, 0}, {3, 1, -2}, 1.2, 0.4};
  for (int trial = 0; trial < 300; ++trial) {
    const Vector3d p = RandomVector(rng, 3);
    // Outside, the hull of two balls is the union of the balls between them.
    double nearest = 1e9;
    for (int k = 0; k <= 4000; ++k) {
      const double t = k / 4000.0;
      nearest = std::min(nearest, (c.a + t * (c.b - c.a) - p).norm() -
                                      (c.radius_a + t * (c.radius_b - c.radius_a)));
    }
    if (nearest > 0) {
      EXPECT_NEAR(SignedDistance(c, p), nearest, 1e-5);
    } else {
      EXPECT_LT(SignedDistance(c, p), 1e-5);
    }
  }
}

TEST(Shape, SkipsOnlyWhatCannotMatter) {
  Rng rng(5);
  Shape shape;
  std::vector<Ellipsoid> balls;
  for (int g = 0; g < 6; ++g) {
    PartGroup& group = shape.AddGroup(g, 0, 0);
    for (int k = 0; k < 5; ++k) {
      balls.push_back({RandomVector(rng, 4), Vector3d(0.5, 0.8, 1.1)});
      Add(group, balls.back());
    }
  }
  shape.Finish();
  for (int trial = 0; trial < 2000; ++trial) {
    const Vector3d p = RandomVector(rng, 5);
    double nearest = 1e9;
    std::size_t which = 0;
    for (std::size_t k = 0; k < balls.size(); ++k) {
      const double d = SignedDistance(balls[k], p);
      if (d < nearest) which = k;
      nearest = std::min(nearest, d);
    }
    ASSERT_EQ(shape.SignedDistance(p), nearest);
    ASSERT_EQ(shape.MaterialAt(p), static_cast<int>(which / 5));
  }
}

}  // namespace
}  // namespace scan
