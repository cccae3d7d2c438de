// Deciding a turn on maps whose relation is known: none, one, two.
#include "reconstruction/appearance/turn_search.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "drivers/base/rng.h"
#include "drivers/base/units.h"
#include "reconstruction/specimens/solid_noise.h"

namespace scan {
namespace {

// A ball of 12 mm.
TurningGrid Ball() {
  TurningGrid grid;
  grid.rings = 60;
  grid.azimuths = 360;
  grid.axis = Eigen::Vector3d::UnitZ();
  grid.spacing_mm = 0.6;
  for (int j = 0; j < grid.rings; ++j) {
    const double latitude = (j + 0.5 - grid.rings / 2.0) * grid.spacing_mm / 12;
    grid.radius_mm.push_back(12 * std::cos(latitude));
    for (int k = 0; k < grid.azimuths; ++k) {
      const double azimuth = k * grid.step_rad();
      grid.position.emplace_back(grid.radius_mm.back() * std::cos(azimuth),
                                 grid.radius_mm.back() * std::sin(azimuth),
                                 12 * std::sin(latitude));
    }
  }
  return grid;
}

// Smooth noise of a wavelength over the ball, turned by `turn_rad`, plus `white` of its own at
// every node.
RingMap Field(const TurningGrid& grid, double wavelength_mm, std::uint32_t seed,
              double turn_rad = 0, double white = 0) {
  RingMap map = MakeRingMap(grid);
  Rng rng(seed + 77);
  const Eigen::AngleAxisd back(-turn_rad, Eigen::Vector3d::UnitZ());
  for (std::size_t i = 0; i < grid.size(); ++i) {
    map.value[i] = static_cast<float>(SolidNoise(back * grid.position[i] / wavelength_mm, seed) +
                                      white * rng.Normal());
    map.weight[i] = 1;
  }
  return map;
}

TurnEstimate FindTurn(const TurningGrid& grid, const std::vector<RingMap>& features,
                      const std::vector<RingMap>& colours) {
  return TurnSearch(grid, features).Find(colours);
}

double Away(double a, double b) { return std::abs(std::remainder(a - b, 2 * kPi)); }

TEST(TurnSearch, FindsTheTurnOfColourThatFollowsAFeature) {
  const TurningGrid grid = Ball();
  for (const double turn : {0.0, 1.234, -2.9}) {
    const std::vector<RingMap> features{Field(grid, 7, 1, 0, 0.2), Field(grid, 5, 2)};
    const std::vector<RingMap> colours{Field(grid, 7, 1, turn, 0.3), Field(grid, 6, 3)};
    const TurnEstimate found = FindTurn(grid, features, colours);
    EXPECT_TRUE(found.decided) << found.reason;
    EXPECT_LT(Away(found.turn_rad, turn), RadFromDeg(0.4));
    EXPECT_LT(found.sigma_rad, RadFromDeg(0.5));
    EXPECT_LT(Away(found.turn_rad, turn), std::max(4 * found.sigma_rad, RadFromDeg(0.1)));
  }
}

TEST(TurnSearch, AnyRelationCounts) {
  const TurningGrid grid = Ball();
  const RingMap feature = Field(grid, 7, 1);
  RingMap colour = Field(grid, 7, 1, 0.5, 0.1);
  for (float& value : colour.value) value = std::abs(value + 0.1f);  // not monotonic
  const TurnEstimate found = FindTurn(grid, std::vector{feature}, std::vector{colour});
  EXPECT_TRUE(found.decided) << found.reason;
  EXPECT_LT(Away(found.turn_rad, 0.5), RadFromDeg(0.5));
}

TEST(TurnSearch, UnrelatedFieldsDecideNothing) {
  const TurningGrid grid = Ball();
  int decided = 0;
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    const double wavelength_mm = 4.0 + seed;
    const std::vector<RingMap> features{Field(grid, wavelength_mm, 100 + seed),
                                        Field(grid, 6, 500 + seed)};
    const std::vector<RingMap> colours{Field(grid, wavelength_mm, 200 + seed),
                                       Field(grid, 9, 300 + seed), Field(grid, 5, 400 + seed)};
    decided += FindTurn(grid, features, colours).decided;
  }
  EXPECT_EQ(decided, 0);
}

TEST(TurnSearch, OneSpotThatFitsAnotherDecidesNothing) {
  const TurningGrid grid = Ball();
  RingMap feature = Field(grid, 5, 1), colour = Field(grid, 5, 2);
  const Eigen::Vector3d there(12, 0, 1), elsewhere(0, 12, 1);
  for (std::size_t i = 0; i < grid.size(); ++i) {
    feature.value[i] *= 0.1f;
    colour.value[i] *= 0.1f;
    feature.value[i] += (grid.position[i] - there).norm() < 4;
    colour.value[i] += (grid.position[i] - elsewhere).norm() < 4;
  }
  EXPECT_FALSE(FindTurn(grid, std::vector{feature}, std::vector{colour}).decided);
}

TEST(TurnSearch, TwoTurnsThatFitAlikeDecideNothing) {
  const TurningGrid grid = Ball();
  RingMap feature = MakeRingMap(grid), colour = feature;
  const RingMap pattern = Field(grid, 5, 1);
  for (int j = 0; j < grid.rings; ++j) {
    for (int k = 0; k < grid.azimuths; ++k) {  // the same on both halves
      feature.value[grid.index(j, k)] = pattern.value[grid.index(j, k % (grid.azimuths / 2))];
      feature.weight[grid.index(j, k)] = 1;
    }
  }
  colour = feature;
  const TurnEstimate found = FindTurn(grid, std::vector{feature}, std::vector{colour});
  EXPECT_FALSE(found.decided);
  EXPECT_NE(found.reason.find("180.0 deg"), std::string::npos) << found.reason;
}

TEST(TurnSearch, EvenColourOrCtDecidesNothingAndSaysWhich) {
  const TurningGrid grid = Ball();
  RingMap even = MakeRingMap(grid);
  std::fill(even.value.begin(), even.value.end(), 0.7f);
  std::fill(even.weight.begin(), even.weight.end(), 1.f);
  const RingMap pattern = Field(grid, 5, 1);
  EXPECT_EQ(FindTurn(grid, std::vector{pattern}, std::vector{even}).reason,
            "the colour is the same all round");
  EXPECT_EQ(FindTurn(grid, std::vector{even}, std::vector{pattern}).reason,
            "the CT is the same all round");
  RingMap noise = even;
  Rng rng(1);
  for (float& value : noise.value) value = static_cast<float>(rng.Normal());
  EXPECT_FALSE(FindTurn(grid, std::vector{pattern}, std::vector{noise}).decided);
}

}  // namespace
}  // namespace scan
