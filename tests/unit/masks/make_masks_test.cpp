#include "reconstruction/masks/make_masks.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "drivers/base/rng.h"
#include "reconstruction/masks/contour.h"
#include "reconstruction/specimens/photograph.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/masks/coverage.h"

namespace scan {
namespace {

double Srgb(double l) { return l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1 / 2.4) - 0.055; }

struct Scene {
  cv::Mat photo, plate, coverage;
};

// Mixes a textured specimen and a textured background by exact coverage in linear light, adds
// noise to photograph and plate; the photograph is `gain` times as bright.
Scene Compose(const cv::Mat& coverage, double gain, double noise_codes, std::uint64_t seed) {
  Scene scene;
  scene.coverage = ToBytes(coverage);
  scene.photo.create(coverage.size(), CV_8UC3);
  scene.plate.create(coverage.size(), CV_8UC3);
  Rng rng(seed);
  auto noisy = [&](double linear) {
    const double gauss = rng.Uniform() + rng.Uniform() + rng.Uniform() + rng.Uniform() - 2;
    const double code = 255 * Srgb(std::min(1.0, linear)) + noise_codes * gauss * std::sqrt(3.0);
    return cv::saturate_cast<uchar>(code);
  };
  for (int y = 0; y < coverage.rows; ++y) {
    for (int x = 0; x < coverage.cols; ++x) {
      const double a = coverage.at<float>(y, x);
      for (int c = 0; c < 3; ++c) {
        const double back = 0.55 + 0.1 * c + 0.1 * std::sin(0.02 * x + c) * std::cos(0.03 * y);
        const double front = 0.1 + 0.06 * (2 - c) + 0.04 * std::sin(0.11 * x) * std::sin(0.13 * y);
        scene.photo.at<cv::Vec3b>(y, x)[c] = noisy(gain * (a * front + (1 - a) * back));
        scene.plate.at<cv::Vec3b>(y, x)[c] = noisy(back);
      }
    }
  }
  return scene;
}

struct EdgeError {
  double bias = 0, rms = 0, found = 0;
};

// Signed distance of the true contour's points from the found contour, positive when the mask is
// too large: along the true normal, from the coverage profile of both.
EdgeError CompareContours(const cv::Mat& found_coverage, const cv::Mat& true_coverage) {
  Mask found, truth;
  found.coverage = found_coverage;
  truth.coverage = true_coverage;
  std::vector<ContourPoint> points;
  for (const Contour& contour : ExtractContours(found)) {
    for (const ContourPoint& point : Resampled(contour, 0.5).points) points.push_back(point);
  }
  EdgeError error;
  double sum = 0, squares = 0;
  std::size_t hits = 0, total = 0;
  cv::Mat cells(found_coverage.size(), CV_32S, cv::Scalar(-1));
  std::vector<int> next(points.size(), -1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    int& head =
        cells.at<int>(std::clamp(static_cast<int>(points[i].position.y()), 0, cells.rows - 1),
                      std::clamp(static_cast<int>(points[i].position.x()), 0, cells.cols - 1));
    next[i] = head;
    head = static_cast<int>(i);
  }
  for (const Contour& contour : ExtractContours(truth)) {
    for (const ContourPoint& point : Resampled(contour, 1.0).points) {
      ++total;
      double best = 2.5 * 2.5, signed_distance = 0;
      for (int y = static_cast<int>(point.position.y()) - 2; y <= point.position.y() + 2; ++y) {
        for (int x = static_cast<int>(point.position.x()) - 2; x <= point.position.x() + 2; ++x) {
          if (x < 0 || y < 0 || x >= cells.cols || y >= cells.rows) continue;
          for (int i = cells.at<int>(y, x); i >= 0; i = next[i]) {
            const Eigen::Vector2d d = points[i].position - point.position;
            if (d.squaredNorm() < best && points[i].normal.dot(point.normal) > 0.5) {
              best = d.squaredNorm();
              signed_distance = d.dot(point.normal);
            }
          }
        }
      }
      if (best >= 2.5 * 2.5) continue;
      ++hits;
      sum += signed_distance;
      squares += signed_distance * signed_distance;
    }
  }
  error.bias = sum / static_cast<double>(hits);
  error.rms = std::sqrt(squares / static_cast<double>(hits));
  error.found = static_cast<double>(hits) / static_cast<double>(total);
  return error;
}

double Blob(double x, double y) {
  const double dx = x - 210.3, dy = y - 160.7, angle = std::atan2(dy, dx);
  return std::hypot(dx, dy) - 80 - 15 * std::sin(5 * angle);
}

// Legs of 2.5 px with gaps of 5 px between them.
double Legs(double x, double y) {
  double d = 1e9;
  for (int i = 0; i < 6; ++i) {
    const double across = (x - 0.25 * y) - (100.4 + 7.5 * i);
    d = std::min(d, std::abs(across) / std::sqrt(1 + 0.0625) - 1.25);
  }
  const double body = std::hypot((x - 140) / 1.0, y - 60.0) - 45;
  return std::min(body, std::max(d, std::max(60 - y, y - 200)));
}

TEST(MakeMask, BoundaryIsSubPixelAndUnbiased) {
  const Scene scene = Compose(CoverageOf({420, 320}, Blob), 1.0, 1.5, 1);
  const auto mask = MakeMask(scene.photo, scene.plate, {});
  ASSERT_TRUE(mask) << ToString(mask.error());
  const EdgeError error = CompareContours(mask->coverage, scene.coverage);
  EXPECT_NEAR(error.bias, 0, 0.05);
  EXPECT_LT(error.rms, 0.12);
  EXPECT_GT(error.found, 0.999);
  EXPECT_FALSE(mask->binary);
}

TEST(MakeMask, ExposureDriftOfThePlateIsMatched) {
  for (const double gain : {0.85, 1.12}) {
    const Scene scene = Compose(CoverageOf({420, 320}, Blob), gain, 1.5, 2);
    const auto mask = MakeMask(scene.photo, scene.plate, {});
    ASSERT_TRUE(mask) << ToString(mask.error());
    const EdgeError error = CompareContours(mask->coverage, scene.coverage);
    EXPECT_NEAR(error.bias, 0, 0.06) << gain;
    EXPECT_LT(error.rms, 0.15) << gain;
    EXPECT_EQ(ExtractContours(*mask).size(), 1u) << gain;
  }
}

TEST(MakeMask, GapsBetweenThinLegsStayOpen) {
  const Scene scene = Compose(CoverageOf({300, 220}, Legs), 1.0, 1.5, 3);
  const auto mask = MakeMask(scene.photo, scene.plate, {});
  ASSERT_TRUE(mask) << ToString(mask.error());
  const EdgeError error = CompareContours(mask->coverage, scene.coverage);
  EXPECT_GT(error.found, 0.98);
  EXPECT_NEAR(error.bias, 0, 0.1);
  EXPECT_LT(error.rms, 0.2);
}

TEST(MakeMask, SpecksAreRemoved) {
  Scene scene = Compose(CoverageOf({420, 320}, Blob), 1.0, 1.5, 4);
  cv::circle(scene.photo, {40, 40}, 2, cv::Scalar(10, 10, 10), -1);
  const auto mask = MakeMask(scene.photo, scene.plate, {});
  ASSERT_TRUE(mask);
  EXPECT_EQ(cv::countNonZero(mask->coverage(cv::Rect(30, 30, 20, 20)) > 127), 0);
}

TEST(MakeMask, GrabCutWithoutAPlate) {
  const Scene scene = Compose(CoverageOf({420, 320}, Blob), 1.0, 1.5, 5);
  const auto mask = MakeMask(scene.photo, {}, {});
  ASSERT_TRUE(mask) << ToString(mask.error());
  const EdgeError error = CompareContours(mask->coverage, scene.coverage);
  EXPECT_NEAR(error.bias, 0, 0.1);
  EXPECT_LT(error.rms, 0.2);
  const auto again = MakeMask(scene.photo, {}, {});
  EXPECT_EQ(cv::norm(mask->coverage, again->coverage, cv::NORM_INF), 0);
}

TEST(MakeMask, BadPicturesAreRefused) {
  const Scene scene = Compose(
      CoverageOf({64, 48}, [](double x, double y) { return std::hypot(x - 30, y - 20) - 10; }), 1.0,
      1.0, 6);
  const cv::Mat small = scene.plate(cv::Rect(0, 0, 32, 32));
  for (const auto& result : {MakeMask({}, {}, {}), MakeMask(scene.photo, small, {}),
                             MakeMask(scene.photo, scene.plate, cv::Mat::zeros(3, 3, CV_8U)),
                             MakeMask(cv::Mat::zeros(48, 64, CV_8U), {}, {}),
                             MakeMask(scene.photo, scene.plate, {}, MaskOptions{.band_px = 0})}) {
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().kind, ErrorKind::bad_input);
  }
  EXPECT_FALSE(MakeMask(scene.plate, scene.plate, {}));  // nothing there
  EXPECT_FALSE(MakeMask(cv::Mat::zeros(48, 64, CV_8UC3), {}, {}));
}

class MaskFiles : public ::testing::Test {
 protected:
  MaskFiles() {
    set.session = folder.path();
    set.lens_states.push_back({"l0", {.w = 420, .h = 320}, {}});
    set.aims.resize(1);
    set.aims[0].background_plate = folder.path() / "plate.png";
    for (int i = 0; i < 3; ++i) {
      const Scene scene = Compose(CoverageOf({420, 320}, Blob), 1.0 + 0.02 * i, 1.5, 10 + i);
      const std::string name = "v00" + std::to_string(i) + "_c0";
      cv::imwrite((folder.path() / (name + ".png")).string(), scene.photo);
      if (i == 0) cv::imwrite((folder.path() / "plate.png").string(), scene.plate);
      Photo& photo = set.photos.emplace_back();
      photo.name = name;
      photo.path = folder.path() / (name + ".png");
    }
  }
  TempFolder folder;
  PhotoSet set;
};

TEST_F(MaskFiles, SameBytesForAnyNumberOfThreads) {
  const auto masks = MakeMasks(set);
  ASSERT_TRUE(masks) << ToString(masks.error());
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const auto again = MakeMasks(set);
  ASSERT_TRUE(again);
  for (std::size_t i = 0; i < masks->size(); ++i) {
    EXPECT_EQ(cv::norm((*masks)[i].coverage, (*again)[i].coverage, cv::NORM_INF), 0);
  }
}

TEST_F(MaskFiles, SavedMasksAreLoadedAsGiven) {
  const auto masks = MakeMasks(set);
  ASSERT_TRUE(masks);
  ASSERT_TRUE(SaveMasks(set, *masks));
  for (Photo& photo : set.photos) {
    photo.mask_path = folder.path() / "derived" / "masks" / (photo.name + ".png");
  }
  const auto given = MakeMasks(set);
  ASSERT_TRUE(given) << ToString(given.error());
  EXPECT_EQ(cv::norm((*masks)[2].coverage, (*given)[2].coverage, cv::NORM_INF), 0);
}

TEST_F(MaskFiles, BadFilesAreNamed) {
  set.photos[1].mask_path = folder.path() / "none.png";
  auto result = MakeMasks(set);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, ErrorKind::bad_input);
  EXPECT_NE(result.error().where.find("none.png"), std::string::npos);

  cv::imwrite((folder.path() / "small.png").string(), cv::Mat(5, 5, CV_8U, cv::Scalar(9)));
  set.photos[1].mask_path = folder.path() / "small.png";
  result = MakeMasks(set);
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().what.find("5 x 5"), std::string::npos);

  set.photos[1].mask_path.clear();
  std::ofstream(set.photos[1].path) << "no picture";
  EXPECT_FALSE(MakeMasks(set));

  std::stop_source stop;
  stop.request_stop();
  result = MakeMasks(set, {}, {}, stop.get_token());
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, ErrorKind::cancelled);
}

TEST(LoadMask, BinaryIsRecognisedAndStretched) {
  TempFolder folder;
  cv::Mat picture = cv::Mat::zeros(20, 30, CV_8U);
  picture(cv::Rect(5, 5, 8, 8)) = 1;
  cv::imwrite((folder.path() / "m.png").string(), picture);
  const auto mask = LoadMask(folder.path() / "m.png", {30, 20});
  ASSERT_TRUE(mask);
  EXPECT_TRUE(mask->binary);
  EXPECT_EQ(mask->coverage.at<uchar>(7, 7), 255);
  picture.at<uchar>(0, 0) = 77;
  cv::imwrite((folder.path() / "m.png").string(), picture);
  EXPECT_FALSE(LoadMask(folder.path() / "m.png", {30, 20})->binary);
}

}  // namespace
}  // namespace scan
