#include "reconstruction/render/shade.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/support/meshes.h"

namespace scan {
namespace {

TEST(Shade, ConvexBodiesSeeTheWholeSky) {
  for (const float share : SkyShare(meshes::Icosphere(3, 3))) EXPECT_GT(share, 0.97f);
}

TEST(Shade, TheInsideOfATubeSeesLittleOfIt) {
  const TriangleMesh tube =
      meshes::Joined(meshes::OpenCylinder(1, 12, 40, 40), meshes::Icosphere(0.4, 2, {0, 0, 6}));
  const std::vector<float> sky = SkyShare(tube);
  EXPECT_LT(sky.back(), 0.15f);
}

TEST(Shade, PictureHoldsTheWholeMeshOnWhite) {
  const TriangleMesh box = meshes::Box({0, 0, 0}, {1, 2, 4});
  ShadeOptions options;
  options.height_px = 120;
  const cv::Mat picture = ShadedPicture(box, {}, options);
  ASSERT_EQ(picture.type(), CV_8UC3);
  ASSERT_EQ(picture.rows, 120);
  // Longest axis upright, thinnest in depth: two panels of 2 : 4.
  EXPECT_NEAR(picture.cols, 2 * 60, 8);
  for (int x : {0, picture.cols - 1})
    EXPECT_EQ(picture.at<cv::Vec3b>(60, x), cv::Vec3b(255, 255, 255));
  for (int x : {30, 90}) {
    const cv::Vec3b grey = picture.at<cv::Vec3b>(60, x);
    EXPECT_EQ(grey[0], grey[2]);
    EXPECT_GT(grey[0], 40);
    EXPECT_LT(grey[0], 250);
  }
  const std::vector<Eigen::Vector3f> red(box.faces.size(), {0.5f, 0, 0});
  const cv::Vec3b coloured = ShadedPicture(box, red, options).at<cv::Vec3b>(60, 30);
  EXPECT_EQ(coloured[0], 0);
  EXPECT_GT(coloured[2], 40);
}

TEST(Shade, SamePictureForAnyNumberOfThreads) {
  const TriangleMesh mesh = meshes::Torus(5, 2, 40, 20);
  const auto with_threads = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    ShadeOptions options;
    options.height_px = 64;
    return ShadedPicture(mesh, {}, options);
  };
  const cv::Mat one = with_threads(1), two = with_threads(2);
  ASSERT_EQ(one.size(), two.size());
  EXPECT_EQ(cv::norm(one, two), 0);
}

}  // namespace
}  // namespace scan
