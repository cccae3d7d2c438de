#include "reconstruction/surface/surface.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "drivers/base/rng.h"
#include "tests/support/solid_volume.h"

namespace scan {
namespace {

using Eigen::Vector3d;

std::function<double(const Vector3d&)> Sphere(double radius) {
  return [radius](const Vector3d& p) { return p.norm() - radius; };
}
double Uniform(double) { return 200; }

struct Deviation {
  double mean = 0, rms = 0, max = 0;
};
Deviation DeviationOf(const TriangleMesh& mesh,
                      const std::function<double(const Vector3d&)>& distance) {
  Deviation out;
  for (const Vector3d& v : mesh.vertices) {
    const double d = distance(v);
    out.mean += d;
    out.rms += d * d;
    out.max = std::max(out.max, std::abs(d));
  }
  out.mean /= static_cast<double>(mesh.vertices.size());
  out.rms = std::sqrt(out.rms / static_cast<double>(mesh.vertices.size()));
  return out;
}

SurfaceResult Extract(const Volume& volume, SurfaceOptions options = {}) {
  auto result = ExtractSurface(volume, options);
  EXPECT_TRUE(result) << ToString(result.error());
  return result ? std::move(*result) : SurfaceResult{};
}

TEST(ExtractSurface, SphereIsClosedOutwardAndInPlace) {
  SolidVolume shape;
  const auto distance = Sphere(8.0);
  const SurfaceResult r = Extract(MakeSolidVolume(shape, distance, Uniform));
  EXPECT_TRUE(r.topology.closed_manifold());
  EXPECT_EQ(r.topology.euler, 2);
  const double exact = 4.0 / 3 * std::numbers::pi * 8 * 8 * 8;
  EXPECT_NEAR(SignedVolume(r.mesh), exact, 0.01 * exact);
  const Deviation d = DeviationOf(r.mesh, distance);
  EXPECT_LT(std::abs(d.mean), 0.02 * 0.5);
  EXPECT_LT(d.max, 0.2 * 0.5);
}

// The global threshold lies between air and the mean of both materials; the surface still belongs
// half-way between air and what lies under it.
TEST(ExtractSurface, DenseCoreDoesNotMoveTheSurface) {
  SolidVolume shape;
  shape.noise = 4;
  const auto distance = Sphere(8.0);
  for (const double shell : {90.0, 240.0}) {
    const auto grey = [&](double d) { return d < -3.0 ? 330.0 - shell : shell; };
    const SurfaceResult r = Extract(MakeSolidVolume(shape, distance, grey));
    const Deviation d = DeviationOf(r.mesh, distance);
    EXPECT_LT(std::abs(d.mean), 0.05 * 0.5) << shell;
    EXPECT_LT(d.rms, 0.15 * 0.5) << shell;
  }
}

TEST(ExtractSurface, AnisotropicVoxelsDirectionAndMirroring) {
  SolidVolume shape;
  shape.size = {60, 52, 26};
  shape.spacing_mm = {0.4, 0.45, 0.9};
  shape.blur_mm = 0.9;
  shape.direction = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  shape.direction.col(1) *= -1;  // left-handed
  const auto distance = [](const Vector3d& p) { return (p - Vector3d(0.3, 0.5, -0.2)).norm() - 7; };
  const SurfaceResult r = Extract(MakeSolidVolume(shape, distance, Uniform));
  EXPECT_TRUE(r.topology.closed_manifold());
  EXPECT_GT(SignedVolume(r.mesh), 0);
  const Deviation d = DeviationOf(r.mesh, distance);
  EXPECT_LT(std::abs(d.mean), 0.04 * 0.4);
  EXPECT_LT(d.max, 0.5 * 0.4);
}

TEST(ExtractSurface, TorusKeepsItsHole) {
  SolidVolume shape;
  const auto distance = [](const Vector3d& p) {
    return Eigen::Vector2d(Eigen::Vector2d(p.x(), p.y()).norm() - 7, p.z()).norm() - 2.5;
  };
  SurfaceOptions options;
  options.decimate.faces = 2000;
  const SurfaceResult r = Extract(MakeSolidVolume(shape, distance, Uniform), options);
  EXPECT_TRUE(r.topology.closed_manifold());
  EXPECT_EQ(r.topology.euler, 0);
  EXPECT_LE(r.mesh.faces.size(), 2000u);
  EXPECT_GT(r.mesh.faces.size(), 1500u);
  EXPECT_GT(r.max_deviation_mm, 0);
  EXPECT_LT(r.max_deviation_mm, 0.25);
  EXPECT_LT(std::abs(DeviationOf(r.mesh, distance).mean), 0.05);
}

// A leg three voxels thick on a body: there at its whole length and its right thickness.
TEST(ExtractSurface, ThinCylinderSurvives) {
  SolidVolume shape;
  shape.spacing_mm = Vector3d::Constant(1.0);
  shape.blur_mm = 1.0;
  const auto leg = [](const Vector3d& p) {
    return std::max(Eigen::Vector2d(p.y(), p.z()).norm() - 1.5, std::abs(p.x() - 8.0) - 12.0);
  };
  const auto distance = [&](const Vector3d& p) {
    return std::min((p + Vector3d(10, 0, 0)).norm() - 8, leg(p));
  };
  const SurfaceResult r = Extract(MakeSolidVolume(shape, distance, Uniform));
  EXPECT_EQ(r.topology.components, 1u);
  EXPECT_NEAR(BoundsOf(r.mesh).high.x(), 20.0, 0.5);
  double sum = 0;
  int count = 0;
  for (const Vector3d& v : r.mesh.vertices)
    if (v.x() > 2 && v.x() < 18) sum += Eigen::Vector2d(v.y(), v.z()).norm(), ++count;
  EXPECT_NEAR(sum / count, 1.5, 0.1);
}

TEST(ExtractSurface, CavityIsFilledOrKept) {
  SolidVolume shape;
  const auto shell = [](const Vector3d& p) { return std::abs(p.norm() - 6.5) - 2; };
  const Volume volume = MakeSolidVolume(shape, shell, Uniform);
  SurfaceOptions options;
  const SurfaceResult filled = Extract(volume, options);
  EXPECT_EQ(filled.topology.components, 1u);
  EXPECT_LT(std::abs(DeviationOf(filled.mesh, Sphere(8.5)).mean), 0.02 * 0.5);
  options.segment.fill_cavities = false;
  const SurfaceResult hollow = Extract(volume, options);
  EXPECT_EQ(hollow.topology.components, 2u);
  EXPECT_TRUE(hollow.topology.closed_manifold());
  EXPECT_LT(std::abs(DeviationOf(hollow.mesh, shell).mean), 0.02 * 0.5);
}

// Letting the outside into gaps and pores only ever cuts handles of what is closed at the leak's
// scale: with the contour's own notion of what touches, to the last voxel.
TEST(ExtractSurface, GapsAndPoresMakeNoHandles) {
  Volume volume;
  volume.size = {36, 36, 36};
  Rng rng(11);
  for (int k = 0; k < 36; ++k)
    for (int j = 0; j < 36; ++j)
      for (int i = 0; i < 36; ++i) {
        const double r = Vector3d(i - 17.5, j - 17.5, k - 17.5).norm();
        volume.grey.push_back(r < 14 && rng.Uniform() < 0.7 ? 1.0f : 0.0f);
      }
  const auto euler = [&](int leak_radius, int depth) {
    SurfaceOptions options;
    options.segment.threshold = 0.5;
    options.segment.exterior = {leak_radius, depth};
    options.isosurface.local_threshold = false;
    options.smoothing_iterations = 0;
    options.decimate.faces = 1000000;
    const SurfaceResult r = Extract(volume, options);
    EXPECT_TRUE(r.topology.closed_manifold());
    EXPECT_EQ(r.topology.components, 1u);
    return r.topology.euler;
  };
  EXPECT_LT(euler(0, 16), -60);
  const std::ptrdiff_t closed = euler(2, 0);
  EXPECT_GE(closed, -40);
  EXPECT_GE(euler(2, 1), closed);
  EXPECT_GE(euler(2, 16), closed);
}

TEST(ExtractSurface, MaterialAtTheBorderGivesAClosedMesh) {
  SolidVolume shape;
  shape.size = {20, 20, 20};
  const auto everywhere = [](const Vector3d& p) { return Vector3d(p.x(), p.y(), 0).norm() - 3; };
  SurfaceOptions options;
  options.smoothing_iterations = 0;
  const Volume volume = MakeSolidVolume(shape, everywhere, Uniform);
  const SurfaceResult r = Extract(volume, options);
  EXPECT_TRUE(r.topology.closed_manifold());
  EXPECT_EQ(r.topology.euler, 2);
  EXPECT_NEAR(BoundsOf(r.mesh).high.z(), 5.0, 1e-6);  // half a voxel beyond the last centre
}

// Two bodies on a thread that the reduction would pinch off.
TEST(Decimate, KeepsThinThreads) {
  SolidVolume shape;
  shape.size = {64, 40, 40};
  shape.spacing_mm = Vector3d::Constant(1.0);
  shape.blur_mm = 0.3;
  const auto distance = [](const Vector3d& p) {
    const double thread =
        std::max(Eigen::Vector2d(p.y(), p.z()).norm() - 0.9, std::abs(p.x()) - 16);
    const Vector3d apart(16, 0, 0);
    return std::min({(p - apart).norm() - 12, (p + apart).norm() - 12, thread});
  };
  SurfaceOptions options;
  options.decimate.faces = 300;
  const SurfaceResult r = Extract(MakeSolidVolume(shape, distance, Uniform), options);
  EXPECT_EQ(r.topology.components, 1u);
  EXPECT_EQ(r.topology.euler, 2);
  EXPECT_LT(r.mesh.faces.size(), 600u);
  EXPECT_GT(BoundsOf(r.mesh).high.x(), 27);
  EXPECT_LT(BoundsOf(r.mesh).low.x(), -27);
}

TEST(ExtractSurface, SameBytesForAnyNumberOfThreads) {
  SolidVolume shape;
  shape.noise = 10;
  const Volume volume = MakeSolidVolume(shape, Sphere(9.0), Uniform);
  const auto with_threads = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    SurfaceOptions options;
    options.decimate.faces = 3000;
    return Extract(volume, options).mesh;
  };
  const TriangleMesh one = with_threads(1), two = with_threads(2);
  EXPECT_EQ(one.faces, two.faces);
  EXPECT_TRUE(one.vertices == two.vertices);
}

TEST(ExtractSurface, StopsWhenAsked) {
  std::stop_source stop;
  stop.request_stop();
  const Volume volume = MakeSolidVolume({}, Sphere(8.0), Uniform);
  const auto result = ExtractSurface(volume, {}, {}, stop.get_token());
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, ErrorKind::cancelled);
}

}  // namespace
}  // namespace scan
