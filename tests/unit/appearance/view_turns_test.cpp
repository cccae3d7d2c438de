// Views of a painted ball, each turned by a known angle and lit from the camera.
#include "reconstruction/appearance/view_turns.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <cmath>

#include "drivers/base/units.h"
#include "reconstruction/appearance/surface_features.h"
#include "reconstruction/appearance/turning_grid.h"
#include "reconstruction/specimens/solid_noise.h"
#include "tests/support/meshes.h"

namespace scan {
namespace {

constexpr double kRadius_mm = 12;

struct PaintedBall {
  TriangleMesh mesh = meshes::Icosphere(kRadius_mm, 5);
  MeshBvh bvh{mesh};
  TurningGrid grid = MakeTurningGrid(mesh, bvh, Eigen::Vector3d(0, 0, 2), Eigen::Vector3d::Zero(),
                                     {.azimuths = 360, .largest_rings = 64});
};

const PaintedBall& Painted() {
  static const PaintedBall ball;
  return ball;
}

// What a camera in the direction `azimuth` sees whose pose is astray by `astray_rad`; the light
// falls off away from the line of sight.
ViewColours ViewFrom(const TurningGrid& grid, double azimuth, double astray_rad, double shading) {
  ViewColours view;
  view.colour.fill(MakeRingMap(grid));
  view.normal.resize(grid.size());
  view.off_axis2.assign(grid.size(), 0.f);
  const Eigen::Vector3d towards(std::cos(azimuth), std::sin(azimuth), 0);
  const Eigen::AngleAxisd back(-astray_rad, grid.axis);
  Eigen::Matrix3d camera_from_model;
  camera_from_model.row(0) = grid.axis.cross(towards).transpose();
  camera_from_model.row(1) = -grid.axis.transpose();
  camera_from_model.row(2) = -towards.transpose();
  for (std::size_t i = 0; i < grid.size(); ++i) {
    const double cosine = grid.normal[i].dot(towards);
    if (cosine < 0.35) continue;
    view.normal[i] = (camera_from_model * grid.normal[i]).cast<float>();
    for (std::size_t c = 0; c < kColourChannels; ++c) {
      const Eigen::Vector3d p = back * grid.position[i];
      view.colour[c].value[i] =
          static_cast<float>(0.3 * FractalNoise(p / 4, 2, 0.5, 10 + static_cast<std::uint32_t>(c)) +
                             (c == 2 ? shading * cosine : 0));
      view.colour[c].weight[i] = static_cast<float>(cosine);
    }
  }
  return view;
}

std::vector<ViewColours> SixViews(const std::vector<double>& astray_rad, double shading) {
  std::vector<ViewColours> views;
  for (std::size_t v = 0; v < 6; ++v)
    views.push_back(
        ViewFrom(Painted().grid, static_cast<double>(v) * kPi / 3, astray_rad[v], shading));
  return views;
}

TEST(TurningGrid, RingsStandOnTheSurfaceAndNormalsPointOutward) {
  const TurningGrid& grid = Painted().grid;
  ASSERT_GT(grid.rings, 30);
  for (std::size_t i = 0; i < grid.size(); ++i) {
    EXPECT_NEAR(grid.position[i].norm(), kRadius_mm, 0.05);
    EXPECT_GT(grid.normal[i].dot(grid.position[i].normalized()), 0.99);
    EXPECT_LT(std::abs(grid.relief_mm[i]), 0.05);
  }
  // A step further along the azimuth is a turn about the axis, counter-clockwise.
  const Eigen::AngleAxisd turn(grid.step_rad(), Eigen::Vector3d::UnitZ());
  EXPECT_LT((turn * grid.position[0] - grid.position[1]).norm(), 1e-9);
}

TEST(TurningGrid, WithoutSurfaceRoundTheAxisThereAreNoRings) {
  const TriangleMesh empty;
  EXPECT_EQ(
      MakeTurningGrid(empty, MeshBvh(empty), Eigen::Vector3d::UnitZ(), Eigen::Vector3d::Zero())
          .rings,
      0);
}

TEST(SurfaceFeatures, DensityIsThatUnderTheNode) {
  Volume volume;
  volume.size = {61, 61, 61};
  volume.spacing_mm = Eigen::Vector3d::Constant(0.5);
  volume.origin_mm = Eigen::Vector3d::Constant(-15);
  for (std::size_t k = 0; k < 61; ++k)
    for (std::size_t j = 0; j < 61; ++j)
      for (std::size_t i = 0; i < 61; ++i)  // rises along y
        volume.grey.push_back(static_cast<float>(100 + 10 * (0.5 * static_cast<double>(j) - 15)));
  const TurningGrid& grid = Painted().grid;
  const auto features = SurfaceFeatures(grid, Painted().bvh, &volume);
  ASSERT_EQ(features.size(), 6u);
  const FeatureOptions options;
  for (std::size_t i = 0; i < grid.size(); i += 97) {
    const double depth = 0.5 * (options.depths[0] + options.depths[1]) * kRadius_mm;
    const Eigen::Vector3d p = grid.position[i] - depth * grid.normal[i];
    EXPECT_NEAR(features[0].map.value[i], 100 + 10 * p.y(), 1);
    EXPECT_LT(features[5].map.value[i], 0.05) << "nothing hides the sky of a ball";
  }
  EXPECT_EQ(SurfaceFeatures(grid, Painted().bvh, nullptr).size(), 2u);
}

TEST(LevelLight, TakesTheLightOffAndLeavesTheSurfacesOwnColour) {
  const std::vector<double> none(6, 0.0);
  std::vector<ViewColours> lit = SixViews(none, 0.5);
  const std::vector<ViewColours> even = SixViews(none, 0.0);
  EXPECT_LT(AgreementOf(lit).share, 0.9);
  LevelLight(lit);
  EXPECT_GT(AgreementOf(lit).share, 0.99);
  // What is left differs from the true colour by no more than a constant of each ring.
  RingMap left = Merged(lit)[2], truth = Merged(even)[2];
  TakeOffRingMeans(left);
  TakeOffRingMeans(truth);
  for (std::size_t i = 0; i < left.size(); ++i) EXPECT_NEAR(left.value[i], truth.value[i], 0.02);
}

TEST(ViewTurns, FindsEachViewsTurnAgainstTheOthers) {
  const std::vector<double> astray{RadFromDeg(0.3), 0, 0, RadFromDeg(-1.8), 0, RadFromDeg(0.05)};
  std::vector<ViewColours> views = SixViews(astray, 0.2);
  LevelLight(views);
  const auto turns = ViewTurns(Painted().grid, views, AgreementOf(views).noise);
  double middle = 0;
  for (std::size_t v = 0; v < 6; ++v) middle += (turns[v].turn_rad - astray[v]) / 6;
  for (std::size_t v = 0; v < 6; ++v) {
    EXPECT_NEAR(DegFromRad(turns[v].turn_rad - middle), DegFromRad(astray[v]), 0.04) << v;
    EXPECT_LT(DegFromRad(turns[v].sigma_rad), 0.15);
    views[v] = Turned(views[v], turns[v].turn_rad);
  }
  EXPECT_GT(AgreementOf(views).share, 0.99);
}

TEST(ViewTurns, AViewThatSharesNothingIsNotTurned) {
  const std::vector<ViewColours> views{ViewFrom(Painted().grid, 0, 0.1, 0),
                                       ViewFrom(Painted().grid, kPi, 0, 0)};
  for (const ViewTurn& turn : ViewTurns(Painted().grid, views, AgreementOf(views).noise)) {
    EXPECT_EQ(turn.turn_rad, 0);
    EXPECT_TRUE(std::isinf(turn.sigma_rad));
  }
}

TEST(ViewTurns, AreTheSameForAnyNumberOfThreads) {
  const auto with_threads = [](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    std::vector<ViewColours> views = SixViews({0.01, 0, 0, -0.01, 0, 0}, 0.3);
    LevelLight(views);
    return ViewTurns(Painted().grid, views, AgreementOf(views).noise);
  };
  const auto one = with_threads(1), two = with_threads(2);
  for (std::size_t v = 0; v < 6; ++v) {
    EXPECT_EQ(one[v].turn_rad, two[v].turn_rad);
    EXPECT_EQ(one[v].sigma_rad, two[v].sigma_rad);
  }
}

}  // namespace
}  // namespace scan
