#include "drivers/base/frames.h"

#include <gtest/gtest.h>

#include <type_traits>

#include "drivers/base/units.h"

namespace scan {
namespace {

template <class A, class B>
concept Composable = requires(A a, B b) {
  a* b;
};

TEST(Frames, OnlyMatchingFramesCompose) {
  static_assert(Composable<CameraFromTable, TableFromModel>);
  static_assert(!Composable<CameraFromTable, CameraFromModel>);
  static_assert(std::is_same_v<decltype(CameraFromTable() * TableFromModel()), CameraFromModel>);
}

TEST(Frames, PositiveTurntableAngleTurnsCounterClockwiseSeenFromAbove) {
  const Eigen::Vector3d turned = MakeStationFromTable(RadFromDeg(90)) * Eigen::Vector3d(1, 0, 0);
  EXPECT_TRUE(turned.isApprox(Eigen::Vector3d(0, 1, 0)));
}

TEST(Frames, RaisingTheLiftLowersTheStationSeenFromIt) {
  const auto lift_from_station = MakeLiftFromStation(10, Eigen::Vector3d::UnitZ());
  EXPECT_TRUE((lift_from_station * Eigen::Vector3d::Zero()).isApprox(Eigen::Vector3d(0, 0, -10)));
}

TEST(Frames, InverseAndCentre) {
  const CameraFromTable camera_from_table(
      Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix(),
      Eigen::Vector3d(4, 5, 6));
  const Eigen::Vector3d centre = CameraCentre(camera_from_table);
  EXPECT_NEAR((camera_from_table * centre).norm(), 0, 1e-12);
}

}  // namespace
}  // namespace scan
