#include "reconstruction/specimens/synthetic_ct.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace scan {
namespace {

using Eigen::Vector3d;

float GreyAt(const Volume& v, const Vector3d& p) {
  const Vector3d q = (v.direction.transpose() * (p - v.origin_mm)).cwiseQuotient(v.spacing_mm);
  const Vector3d base = q.array().floor();
  const Vector3d t = q - base;
  double grey = 0;
  for (int c = 0; c < 8; ++c) {
    const Eigen::Vector3i d(c & 1, c >> 1 & 1, c >> 2);
    double weight = 1;
    for (int a = 0; a < 3; ++a) weight *= d[a] ? t[a] : 1 - t[a];
    grey += weight * v.grey[v.index(static_cast<std::size_t>(base.x() + d.x()),
                                    static_cast<std::size_t>(base.y() + d.y()),
                                    static_cast<std::size_t>(base.z() + d.z()))];
  }
  return static_cast<float>(grey);
}

CtOptions Clean() {
  CtOptions options;
  options.voxel_mm = 0.2;
  options.noise_sigma_grey = 0;
  options.air_grey = 0;
  options.dense_grey = 10000;
  return options;
}

TEST(SyntheticCt, IsHalfWayBetweenAirAndShellOnTheSurface) {
  const auto specimen = std::move(*MakeSpecimen("tomato"));
  CtOptions options = Clean();
  options.direction = Eigen::AngleAxisd(0.4, Vector3d(1, 2, 0).normalized()).toRotationMatrix();
  options.voxel_mm = 0.25;
  const Volume volume = SynthesiseCt(*specimen, options);
  double sum = 0;
  int count = 0;
  const TriangleMesh surface = ExactSurface(*specimen, 1.0);
  const auto normals = VertexNormals(surface);
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
    const Vector3d& p = surface.vertices[v];
    if (p.z() > 18) continue;  // the stalk is as thin as the point spread
    sum += GreyAt(volume, p);
    ++count;
    EXPECT_LT(GreyAt(volume, p + 0.7 * normals[v]), 500);
  }
  ASSERT_GT(count, 500);
  EXPECT_NEAR(sum / count, 0.5 * 8500, 350);
}

TEST(SyntheticCt, HoldsTheWholeSpecimenInAtMostTheGivenVoxels) {
  const auto specimen = std::move(*MakeSpecimen("beetle"));
  CtOptions options;
  options.longest_side = 64;
  const Volume volume = SynthesiseCt(*specimen, options);
  EXPECT_EQ(*std::max_element(volume.size.begin(), volume.size.end()), 64u);
  ASSERT_EQ(volume.grey.size(), volume.voxels());
  double face = 0, most = 0;
  for (std::size_t j = 0; j < volume.size[1]; ++j) {
    for (std::size_t i = 0; i < volume.size[0]; ++i) {
      face = std::max<double>(face, volume.grey[volume.index(i, j, 0)]);
    }
  }
  for (float grey : volume.grey) {
    most = std::max<double>(most, grey);
    ASSERT_EQ(grey, std::round(grey));
  }
  EXPECT_LT(face, 9000 + 5 * 700);
  EXPECT_GT(most, 35000);
}

TEST(SyntheticCt, NoiseRingsAndBeamHardeningAreAsAsked) {
  const auto specimen = std::move(*MakeSpecimen("tomato"));
  CtOptions options = Clean();
  options.voxel_mm = 0.5;
  options.air_grey = 5000;
  const Volume clean = SynthesiseCt(*specimen, options);
  options.noise_sigma_grey = 300;
  const Volume noisy = SynthesiseCt(*specimen, options);
  double mean = 0, square = 0;
  for (std::size_t k = 0; k < clean.grey.size(); ++k) {
    const double d = noisy.grey[k] - clean.grey[k];
    mean += d;
    square += d * d;
  }
  const auto n = static_cast<double>(clean.grey.size());
  EXPECT_NEAR(mean / n, 0, 5);
  EXPECT_NEAR(std::sqrt(square / n), 300, 6);

  options.noise_sigma_grey = 0;
  options.ring_grey = 200;
  const Volume rings = SynthesiseCt(*specimen, options);
  EXPECT_NE(rings.grey, clean.grey);
  options.ring_grey = 0;
  options.beam_hardening = 0.3;
  const Volume hard = SynthesiseCt(*specimen, options);
  const Vector3d core(0, 0, 10), skin(14.2, 0, 10.4);
  EXPECT_LT(GreyAt(hard, core) - 5000, 0.75 * (GreyAt(clean, core) - 5000));
  EXPECT_GT(GreyAt(hard, skin) - 5000, 0.95 * (GreyAt(clean, skin) - 5000));
}

TEST(SyntheticCt, SameBytesForAnyNumberOfThreads) {
  const auto specimen = std::move(*MakeSpecimen("orchid"));
  CtOptions options;
  options.longest_side = 48;
  options.ring_grey = 100;
  Volume one, two;
  {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    one = SynthesiseCt(*specimen, options);
  }
  {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
    two = SynthesiseCt(*specimen, options);
  }
  EXPECT_EQ(one.grey, two.grey);
}

}  // namespace
}  // namespace scan
