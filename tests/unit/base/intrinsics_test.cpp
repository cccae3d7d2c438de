#include "drivers/base/intrinsics.h"

#include <gtest/gtest.h>

#include "drivers/base/rng.h"

namespace scan {
namespace {

Intrinsics Lens() {
  return {.w = 1848,
          .h = 1224,
          .fl_x = 5481,
          .fl_y = 5480,
          .cx = 925,
          .cy = 611,
          .k1 = -0.3,
          .k2 = 0.8,
          .p1 = 1e-3,
          .p2 = -2e-3,
          .k3 = 0.1};
}

TEST(Intrinsics, ProjectAndRayAreInverse) {
  Rng rng(1);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector2d pixel(rng.Uniform(0, 1848), rng.Uniform(0, 1224));
    const Eigen::Vector3d ray = RayOfPixel(Lens(), pixel);
    const auto back = Project(Lens(), ray * rng.Uniform(1, 1000));
    ASSERT_TRUE(back);
    EXPECT_NEAR((*back - pixel).norm(), 0, 1e-7);
  }
}

TEST(Intrinsics, DistortionJacobianMatchesDifferences) {
  const Eigen::Vector2d p(0.11, -0.07);
  Eigen::Matrix2d jacobian;
  Distort(Lens(), p, &jacobian);
  const double h = 1e-6;
  for (int k = 0; k < 2; ++k) {
    Eigen::Vector2d step = Eigen::Vector2d::Zero();
    step[k] = h;
    const Eigen::Vector2d column =
        (Distort(Lens(), p + step) - Distort(Lens(), p - step)) / (2 * h);
    EXPECT_NEAR((column - jacobian.col(k)).norm(), 0, 1e-8);
  }
}

TEST(Intrinsics, NothingBehindTheCamera) {
  EXPECT_FALSE(Project(Lens(), {0, 0, -1}));
  EXPECT_FALSE(Project(Lens(), {0, 0, 0}));
}

TEST(Intrinsics, ScaledPictureShowsTheSamePointAtTheScaledPixel) {
  const Intrinsics small = Scaled(Lens(), 462, 306);
  const Eigen::Vector3d x(10, -5, 550);
  const Eigen::Vector2d full = *Project(Lens(), x), reduced = *Project(small, x);
  EXPECT_NEAR((full / 4 - reduced).norm(), 0, 1e-9);
}

}  // namespace
}  // namespace scan
