// An exact body of revolution whose mesh is none: facets and voxel noise must not fake an azimuth.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "drivers/base/units.h"
#include "pose_scene.h"
#include "reconstruction/pose/solve_joint.h"
#include "reconstruction/specimens/specimen.h"
#include "reconstruction/specimens/synthetic_ct.h"
#include "reconstruction/surface/surface.h"

namespace scan {
namespace {

const Specimen& Tomato() {
  static const auto tomato = MakeSpecimen("tomato");
  return **tomato;
}

// The outline of the half plane y = 0, x >= 0, from the lowest point of the axis to the highest:
// (radius, height).
std::vector<Eigen::Vector2d> ProfileOf(const Specimen& body, double step_mm) {
  const auto distance = [&](const Eigen::Vector2d& p) {
    return body.SignedDistance({p.x(), 0, p.y()});
  };
  const auto slope = [&](const Eigen::Vector2d& p) {
    constexpr double kStep = 1e-5;
    const Eigen::Vector2d dx(kStep, 0), dz(0, kStep);
    return Eigen::Vector2d(
        Eigen::Vector2d(distance(p + dx) - distance(p - dx), distance(p + dz) - distance(p - dz))
            .normalized());
  };
  Eigen::Vector2d p(0, body.Bounds().low.z());
  while (distance(p) > 1e-7) p.y() += distance(p);
  std::vector<Eigen::Vector2d> profile{p};
  for (int i = 0; i < 10'000; ++i) {
    const Eigen::Vector2d out = slope(p);
    p += step_mm * Eigen::Vector2d(-out.y(), out.x());
    for (int k = 0; k < 4; ++k) p -= distance(p) * slope(p);
    if (p.x() < 0.5 * step_mm) break;
    profile.push_back(p);
  }
  profile.emplace_back(0, p.y());
  return profile;
}

TriangleMesh Turned(const std::vector<Eigen::Vector2d>& profile, std::uint32_t facets) {
  TriangleMesh mesh;
  const auto rings = static_cast<std::uint32_t>(profile.size() - 2);
  for (std::uint32_t k = 1; k <= rings; ++k) {
    for (std::uint32_t i = 0; i < facets; ++i) {
      const double angle = 2 * kPi * i / facets;
      mesh.vertices.emplace_back(profile[k].x() * std::cos(angle), profile[k].x() * std::sin(angle),
                                 profile[k].y());
    }
  }
  const auto bottom = static_cast<std::uint32_t>(mesh.vertices.size()), top = bottom + 1;
  mesh.vertices.emplace_back(0, 0, profile.front().y());
  mesh.vertices.emplace_back(0, 0, profile.back().y());
  for (std::uint32_t i = 0; i < facets; ++i) {
    const std::uint32_t next = (i + 1) % facets, last = (rings - 1) * facets;
    mesh.faces.push_back({bottom, next, i});
    mesh.faces.push_back({top, last + i, last + next});
    for (std::uint32_t k = 0; k + 1 < rings; ++k) {
      const std::uint32_t ring = k * facets, above = ring + facets;
      mesh.faces.push_back({ring + i, ring + next, above + next});
      mesh.faces.push_back({ring + i, above + next, above + i});
    }
  }
  return mesh;
}

double AngleDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return DegFromRad(std::asin(std::min(1.0, a.cross(b).norm())));
}

// Photographs of the exact body, solved with `mesh`.
void ExpectFreeAzimuth(const TriangleMesh& mesh) {
  const test::Scene scene =
      test::MakeScene(ExactSurface(Tomato(), 0.3),
                      TableFromModel(ExpSo3({0.1, -0.15, 1.3}), Eigen::Vector3d(1.5, -2, 1)),
                      test::MediumPhotos(8, true));
  const auto poses = SolveJoint(mesh, scene.photos, scene.masks, {});
  ASSERT_TRUE(poses) << ToString(poses.error());
  ASSERT_EQ(poses->free_directions.size(), 1u);
  const FreeDirection& free = poses->free_directions[0];
  EXPECT_EQ(free.kind, FreeDirection::Kind::rotation);
  const double axis_deg = AngleDeg(free.axis, Eigen::Vector3d::UnitZ());
  ::testing::Test::RecordProperty("axis_error_deg", fmt::format("{:.4f}", axis_deg));
  EXPECT_LT(axis_deg, 0.1);
  EXPECT_LT(free.point.head<2>().norm(), 0.05);
  for (std::size_t i = 0; i < poses->views.size(); ++i) {
    const ViewPose& view = poses->views[i];
    EXPECT_EQ(view.status, ViewStatus::accepted) << view.name << ": " << view.reason;
    EXPECT_LT(AngleDeg(view.camera_from_model.rotation().col(2), scene.truth[i].rotation().col(2)),
              0.15)
        << view.name;
  }
  // The azimuth's uncertainty is the placing's prior, not what the facets seem to say.
  const Eigen::Vector3d axis = poses->views[0].camera_from_model.rotation() * free.axis;
  EXPECT_GT(axis.dot(poses->views[0].covariance.topLeftCorner<3, 3>() * axis), 0.5);
}

TEST(RevolutionPose, A240GonsAzimuthIsFreeAndItsAxisFound) {
  const TriangleMesh mesh = Turned(ProfileOf(Tomato(), 0.3), 240);
  ASSERT_GT(mesh.faces.size(), 50'000u);
  ExpectFreeAzimuth(mesh);
}

TEST(RevolutionPose, AMarchingCubesMeshsAzimuthIsFreeAndItsAxisFound) {
  CtOptions ct;
  ct.voxel_mm = 0.25;
  ct.noise_sigma_grey = 1500;
  SurfaceOptions options;
  options.smoothing_iterations = 0;
  const auto surface = ExtractSurface(SynthesiseCt(Tomato(), ct), options);
  ASSERT_TRUE(surface) << ToString(surface.error());
  ExpectFreeAzimuth(surface->mesh);
}

}  // namespace
}  // namespace scan
