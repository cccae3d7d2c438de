#include "reconstruction/fiducials/find_bead_images.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

namespace scan {
namespace {

constexpr int kRing = 3;  // px about a patch that tell what is beside it

double Linear(int code) {
  const double v = code / 255.0;
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

class LinearTable {
 public:
  LinearTable() {
    for (int i = 0; i < 256; ++i) values_[static_cast<std::size_t>(i)] = Linear(i);
  }
  Eigen::Vector3d operator()(const cv::Vec3b& bgr) const {
    return {values_[bgr[2]], values_[bgr[1]], values_[bgr[0]]};
  }

 private:
  std::array<double, 256> values_{};
};

Eigen::Vector3d Chromaticity(const Eigen::Vector3d& rgb) { return rgb / std::max(rgb.sum(), 1e-9); }

// A patch and a ring about it, cut from the picture.
struct Patch {
  cv::Mat pixels;  // CV_8UC3
  cv::Mat inside;  // CV_8U, holes filled
  cv::Mat near;    // CV_8U: within two pixels, where the patch may still cover a part
  cv::Mat ring;    // CV_8U: further out
  cv::Point corner;
};

// A linear measure of colour that is 0 for what is around the patch and 1 for its mean colour: the
// share of a mixed pixel, but for shading.
Eigen::Vector3d Discriminant(const Patch& patch, const LinearTable& linear) {
  Eigen::Matrix3d around = 1e-6 * Eigen::Matrix3d::Identity();
  Eigen::Vector3d colour = Eigen::Vector3d::Zero();
  double n = 0, m = 0;
  for (int y = 0; y < patch.pixels.rows; ++y)
    for (int x = 0; x < patch.pixels.cols; ++x) {
      const Eigen::Vector3d rgb = linear(patch.pixels.at<cv::Vec3b>(y, x));
      if (patch.inside.at<uchar>(y, x)) {
        colour += rgb;
        n += 1;
      } else if (patch.ring.at<uchar>(y, x)) {
        around += rgb * rgb.transpose();
        m += 1;
      }
    }
  colour /= std::max(n, 1.0);
  around /= std::max(m, 1.0);
  around += 1e-3 * around.trace() * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d w = around.ldlt().solve(colour);
  return w / std::max(w.dot(colour), 1e-12);
}

// Share of every pixel that is bead, 0..1, CV_64F.
cv::Mat CoverageOf(const Patch& patch, const LinearTable& linear) {
  const Eigen::Vector3d w = Discriminant(patch, linear);
  cv::Mat core;
  cv::erode(patch.inside, core, cv::Mat());
  if (cv::countNonZero(core) == 0) core = patch.inside;
  cv::Mat value(patch.pixels.size(), CV_64F), coverage(patch.pixels.size(), CV_64F, cv::Scalar(0));
  for (int y = 0; y < value.rows; ++y)
    for (int x = 0; x < value.cols; ++x)
      value.at<double>(y, x) = w.dot(linear(patch.pixels.at<cv::Vec3b>(y, x)));
  for (int y = 0; y < value.rows; ++y)
    for (int x = 0; x < value.cols; ++x) {
      if (core.at<uchar>(y, x)) coverage.at<double>(y, x) = 1;
      if (core.at<uchar>(y, x) || !patch.near.at<uchar>(y, x)) continue;
      // The shade of the bead here is that of its inner pixels nearby: a bead is lit from one side,
      // and its centroid must not follow the light.
      double sum = 0, count = 0;
      for (int reach = 1; reach <= 4 && count == 0; ++reach)
        for (int v = std::max(0, y - reach); v <= std::min(value.rows - 1, y + reach); ++v)
          for (int u = std::max(0, x - reach); u <= std::min(value.cols - 1, x + reach); ++u)
            if (core.at<uchar>(v, u)) {
              sum += value.at<double>(v, u);
              count += 1;
            }
      if (count == 0 || sum <= 0) continue;
      coverage.at<double>(y, x) = std::clamp(value.at<double>(y, x) * count / sum, 0.0, 1.0);
    }
  return coverage;
}

BeadImage Measure(const Patch& patch, const cv::Mat& coverage, const cv::Size& picture) {
  BeadImage image;
  double sum = 0;
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (int y = 0; y < coverage.rows; ++y)
    for (int x = 0; x < coverage.cols; ++x) {
      const double a = coverage.at<double>(y, x);
      const Eigen::Vector2d p(x + 0.5, y + 0.5);
      sum += a;
      first += a * p;
      second += a * p * p.transpose();
    }
  if (sum <= 0) return image;
  const Eigen::Vector2d centre = first / sum;
  const Eigen::Matrix2d spread = second / sum - centre * centre.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(spread);
  // A filled ellipse's variance along an axis is a quarter of its square.
  image.semi_axes_px = 2 * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().reverse();
  image.area_px = sum;
  image.centre = centre + Eigen::Vector2d(patch.corner.x, patch.corner.y);
  const cv::Rect box = cv::boundingRect(patch.inside) + patch.corner;
  image.cut = box.x <= 1 || box.y <= 1 || box.x + box.width >= picture.width - 1 ||
              box.y + box.height >= picture.height - 1;
  return image;
}

Patch CutOut(const cv::Mat& picture, const cv::Mat& labels, int label, const cv::Rect& box) {
  constexpr int kNear = 2, kMargin = kNear + kRing + 1;
  const cv::Rect grown = cv::Rect(box.x - kMargin, box.y - kMargin, box.width + 2 * kMargin,
                                  box.height + 2 * kMargin) &
                         cv::Rect(0, 0, picture.cols, picture.rows);
  Patch patch;
  patch.corner = grown.tl();
  patch.pixels = picture(grown);
  const cv::Mat own = labels(grown) == label;
  // Highlights are holes: filled through the outer outline.
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(own.clone(), outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  patch.inside = cv::Mat(own.size(), CV_8U, cv::Scalar(0));
  cv::drawContours(patch.inside, outlines, -1, cv::Scalar(255), cv::FILLED);
  cv::dilate(patch.inside, patch.near, cv::Mat(), cv::Point(-1, -1), kNear);
  cv::dilate(patch.near, patch.ring, cv::Mat(), cv::Point(-1, -1), kRing);
  patch.ring &= ~patch.near;
  return patch;
}

}  // namespace

Result<Eigen::Vector3d> ParseBeadColour(std::string_view text) {
  constexpr double kGrey = 0.12;  // of chromaticity
  const bool form = text.size() == 7 && text.front() == '#' &&
                    text.find_first_not_of("0123456789abcdefABCDEF", 1) == std::string_view::npos;
  if (!form)
    return BadInput(fmt::format("'{}' is no colour", text), "--bead-colour",
                    "give it as #rrggbb, for instance #0060ff");
  const auto part = [&](std::size_t at) {
    return Linear(std::stoi(std::string(text.substr(at, 2)), nullptr, 16));
  };
  const Eigen::Vector3d rgb(part(1), part(3), part(5));
  if (rgb.sum() <= 0 || (Chromaticity(rgb) - Eigen::Vector3d::Constant(1.0 / 3)).norm() < kGrey)
    return BadInput(fmt::format("{} is a grey: light and shade look the same", text),
                    "--bead-colour", "use beads of one strong colour that the specimen has not");
  return rgb;
}

std::vector<BeadImage> FindBeadImages(const cv::Mat& picture, const BeadColourOptions& options) {
  const LinearTable linear;
  const Eigen::Vector3d wanted = Chromaticity(options.colour);
  cv::Mat found(picture.size(), CV_8U, cv::Scalar(0));
  for (int y = 0; y < picture.rows; ++y) {
    const cv::Vec3b* row = picture.ptr<cv::Vec3b>(y);
    for (int x = 0; x < picture.cols; ++x) {
      const Eigen::Vector3d rgb = linear(row[x]);
      if (rgb.sum() > 3 * options.darkest &&
          (Chromaticity(rgb) - wanted).squaredNorm() < options.tolerance * options.tolerance)
        found.at<uchar>(y, x) = 255;
    }
  }
  cv::Mat labels, boxes, centroids;
  const int count = cv::connectedComponentsWithStats(found, labels, boxes, centroids, 8, CV_32S);
  std::vector<BeadImage> images;
  for (int label = 1; label < count; ++label) {
    if (boxes.at<int>(label, cv::CC_STAT_AREA) < 0.5 * options.least_area_px) continue;
    const cv::Rect box(
        boxes.at<int>(label, cv::CC_STAT_LEFT), boxes.at<int>(label, cv::CC_STAT_TOP),
        boxes.at<int>(label, cv::CC_STAT_WIDTH), boxes.at<int>(label, cv::CC_STAT_HEIGHT));
    const Patch patch = CutOut(picture, labels, label, box);
    const BeadImage image = Measure(patch, CoverageOf(patch, linear), picture.size());
    if (image.area_px >= options.least_area_px) images.push_back(image);
  }
  return images;
}

}  // namespace scan
