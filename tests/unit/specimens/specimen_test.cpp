#include "reconstruction/specimens/specimen.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>

#include "drivers/base/rng.h"

namespace scan {
namespace {

using Eigen::Vector3d;

class EverySpecimen : public testing::TestWithParam<std::string> {
 protected:
  std::unique_ptr<Specimen> specimen_ = std::move(*MakeSpecimen(GetParam()));
};
INSTANTIATE_TEST_SUITE_P(Specimens, EverySpecimen, testing::ValuesIn(SpecimenNames()),
                         [](const auto& test) {
                           std::string name = test.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

Vector3d RandomPoint(Rng& rng, const BoundingBox& box, double margin_mm) {
  Vector3d p;
  for (int a = 0; a < 3; ++a) {
    p[a] = rng.Uniform(box.low[a] - margin_mm, box.high[a] + margin_mm);
  }
  return p;
}

TEST(MakeSpecimen, NamesWhatIsUnknownAndWhatThereIs) {
  const auto made = MakeSpecimen("unicorn");
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().kind, ErrorKind::bad_input);
  EXPECT_NE(ToString(made.error()).find("unicorn"), std::string::npos);
  EXPECT_NE(ToString(made.error()).find("beetle"), std::string::npos);
}

TEST_P(EverySpecimen, DistanceHasSlopeAtMostOne) {
  Rng rng(1);
  for (int trial = 0; trial < 20000; ++trial) {
    const Vector3d p = RandomPoint(rng, specimen_->Bounds(), 2);
    Vector3d step(rng.Normal(), rng.Normal(), rng.Normal());
    step *= std::pow(10.0, rng.Uniform(-2, 0.5)) / step.norm();
    const double change = specimen_->SignedDistance(p + step) - specimen_->SignedDistance(p);
    ASSERT_LE(std::abs(change), step.norm() * (1 + 1e-6) + 1e-9)
        << p.transpose() << " step " << step.transpose();
  }
}

TEST_P(EverySpecimen, SurfaceIsAClosedManifoldOnTheZeroSet) {
  const TriangleMesh surface = ExactSurface(*specimen_, 0.2);
  const TopologyReport topology = CheckTopology(surface);
  EXPECT_TRUE(topology.closed_manifold());
  EXPECT_EQ(topology.components, 1u);
  EXPECT_GT(SignedVolume(surface), 100);
  const auto normals = VertexNormals(surface);
  std::size_t unit_slopes = 0;
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
    const Vector3d& p = surface.vertices[v];
    ASSERT_LT(std::abs(specimen_->SignedDistance(p)), 5e-5);
    const double slope = (specimen_->SignedDistance(p + 0.02 * normals[v]) -
                          specimen_->SignedDistance(p - 0.02 * normals[v])) /
                         0.04;
    unit_slopes += slope > 0.85;
  }
  EXPECT_GT(static_cast<double>(unit_slopes), 0.93 * static_cast<double>(surface.vertices.size()));
}

TEST_P(EverySpecimen, IsAboutThirtyMillimetresAndWithinItsBounds) {
  const TriangleMesh surface = ExactSurface(*specimen_, 0.5);
  const BoundingBox given = specimen_->Bounds(), found = BoundsOf(surface);
  EXPECT_TRUE((found.low.array() >= given.low.array() - 1e-6).all());
  EXPECT_TRUE((found.high.array() <= given.high.array() + 1e-6).all());
  EXPECT_NEAR((found.high - found.low).maxCoeff(), 30, 4);
}

TEST_P(EverySpecimen, SurfaceHasTheSameBytesForAnyNumberOfThreads) {
  TriangleMesh one, two;
  {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    one = ExactSurface(*specimen_, 0.8);
  }
  {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
    two = ExactSurface(*specimen_, 0.8);
  }
  EXPECT_EQ(one.faces, two.faces);
  ASSERT_EQ(one.vertices.size(), two.vertices.size());
  EXPECT_EQ(
      std::memcmp(one.vertices.data(), two.vertices.data(), one.vertices.size() * sizeof(Vector3d)),
      0);
}

TEST_P(EverySpecimen, ColourDiffersEverywhere) {
  // The contrast that a texture shifted by 1 mm along the surface would show.
  const TriangleMesh surface = ExactSurface(*specimen_, 0.5);
  const auto normals = VertexNormals(surface);
  Rng rng(4);
  int flat = 0, tried = 0;
  for (; tried < 2000; ++tried) {
    const std::size_t v = rng.Below(surface.vertices.size());
    const Vector3d& p = surface.vertices[v];
    const Vector3d along = normals[v].cross(Vector3d(rng.Normal(), rng.Normal(), rng.Normal()));
    const Vector3d colour = specimen_->Albedo(p);
    ASSERT_TRUE((colour.array() >= 0).all() && (colour.array() <= 1).all());
    double contrast = 0;
    for (double s : {-1.0, -0.5, 0.5, 1.0}) {
      const Vector3d other = specimen_->Albedo(p + s * along.normalized());
      contrast = std::max(contrast, (other - colour).norm() / (other + colour).norm());
    }
    flat += contrast < 0.02;
  }
  EXPECT_LT(flat, tried / 50);
}

TEST_P(EverySpecimen, DensityIsWithinBoundsAndZeroOutside) {
  Rng rng(9);
  int inside = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const Vector3d p = RandomPoint(rng, specimen_->Bounds(), 1);
    const double density = specimen_->Density(p);
    ASSERT_GE(density, 0);
    ASSERT_LE(density, 1);
    if (specimen_->SignedDistance(p) > 1e-9) {
      ASSERT_EQ(density, 0);
    } else {
      ++inside;
    }
  }
  EXPECT_GT(inside, 100);
}

}  // namespace
}  // namespace scan
