#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "reconstruction/masks/segmentation.h"

namespace scan {
namespace {

cv::Mat Disk(int radius) {
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, cv::Size(2 * radius + 1, 2 * radius + 1));
}

// Gaussian mean of `values` where `weight` says: so steep that the nearest samples decide.
// CV_32FC3; `support` receives the smoothed weight.
cv::Mat NearestMean(const cv::Mat& values, const cv::Mat& weight, double sigma_px,
                    cv::Mat* support = nullptr) {
  cv::Mat weighted(values.size(), CV_32FC3), sum, total;
  for (int y = 0; y < values.rows; ++y) {
    for (int x = 0; x < values.cols; ++x) {
      weighted.at<cv::Vec3f>(y, x) = values.at<cv::Vec3f>(y, x) * weight.at<float>(y, x);
    }
  }
  const int size = 2 * static_cast<int>(4 * sigma_px) + 1;
  cv::GaussianBlur(weighted, sum, {size, size}, sigma_px);
  cv::GaussianBlur(weight, total, {size, size}, sigma_px);
  for (int y = 0; y < values.rows; ++y) {
    for (int x = 0; x < values.cols; ++x) {
      const float t = total.at<float>(y, x);
      cv::Vec3f& s = sum.at<cv::Vec3f>(y, x);
      s = t > 1e-9f ? s * (1 / t) : cv::Vec3f(0, 0, 0);
    }
  }
  if (support) *support = total;
  return sum;
}

cv::Mat ContrastOf(const cv::Mat& photo, const cv::Mat& background) {
  cv::Mat contrast(photo.size(), CV_32F);
  for (int y = 0; y < photo.rows; ++y) {
    for (int x = 0; x < photo.cols; ++x) {
      const cv::Vec3f d = photo.at<cv::Vec3f>(y, x) - background.at<cv::Vec3f>(y, x);
      contrast.at<float>(y, x) = d.dot(d);
    }
  }
  return contrast;
}

// 1 for sure foreground; where a leg is too thin to have any, a little for the pixels that differ
// most from the background nearby: on the axis of the leg, and where it covers them whole.
cv::Mat ForegroundWeight(const cv::Mat& photo, const cv::Mat& background, const cv::Mat& labels,
                         int inner_px) {
  cv::Mat sure, strongest, weight(labels.size(), CV_32F);
  cv::erode(labels, sure, Disk(inner_px), {-1, -1}, 1, cv::BORDER_CONSTANT, cv::Scalar(255));
  const cv::Mat contrast = ContrastOf(photo, background);
  cv::dilate(contrast, strongest, cv::getStructuringElement(cv::MORPH_RECT, {9, 9}));
  constexpr float kAxisShare = 0.72f;  // of the squared contrast: 0.85 of the contrast
  for (int y = 0; y < labels.rows; ++y) {
    for (int x = 0; x < labels.cols; ++x) {
      const bool axis = labels.at<uchar>(y, x) &&
                        contrast.at<float>(y, x) >= kAxisShare * strongest.at<float>(y, x);
      weight.at<float>(y, x) = sure.at<uchar>(y, x) ? 1.f : axis ? 1e-3f : 0.f;
    }
  }
  return weight;
}

}  // namespace

cv::Mat BackgroundFromPhoto(const cv::Mat& photo, const cv::Mat& labels, int margin_px) {
  cv::Mat grown, weight(labels.size(), CV_32F), support;
  cv::dilate(labels, grown, Disk(margin_px));
  for (int y = 0; y < labels.rows; ++y) {
    for (int x = 0; x < labels.cols; ++x)
      weight.at<float>(y, x) = grown.at<uchar>(y, x) ? 0.f : 1.f;
  }
  cv::Mat background = NearestMean(photo, weight, std::max(2.0, 0.7 * margin_px), &support);
  const cv::Scalar mean = cv::mean(photo, 255 - grown);
  for (int y = 0; y < labels.rows; ++y) {
    for (int x = 0; x < labels.cols; ++x) {
      if (!grown.at<uchar>(y, x)) {
        background.at<cv::Vec3f>(y, x) = photo.at<cv::Vec3f>(y, x);
      } else if (support.at<float>(y, x) <= 1e-9f) {
        for (int c = 0; c < 3; ++c) background.at<cv::Vec3f>(y, x)[c] = static_cast<float>(mean[c]);
      }
    }
  }
  return background;
}

cv::Mat CoverageFromLabels(const cv::Mat& photo_linear, const cv::Mat& background_linear,
                           const cv::Mat& labels, int outer_px, int inner_px) {
  cv::Mat coverage = labels.clone();
  cv::Rect box = cv::boundingRect(labels);
  if (box.empty()) return coverage;
  const int reach = outer_px + 20;
  box = (cv::Rect(box.x - reach, box.y - reach, box.width + 2 * reach, box.height + 2 * reach)) &
        cv::Rect(0, 0, labels.cols, labels.rows);
  const cv::Mat photo = photo_linear(box), label = labels(box);
  cv::Mat background = background_linear(box).clone();
  cv::Mat out = coverage(box);

  // The plate is corrected by what the nearest sure background differs from it: light that the
  // specimen reflects or keeps away, and drift that one factor does not describe.
  cv::Mat grown, shrunk, off(photo.size(), CV_32F);
  cv::dilate(label, grown, Disk(outer_px));
  cv::erode(label, shrunk, Disk(inner_px), {-1, -1}, 1, cv::BORDER_CONSTANT, cv::Scalar(255));
  for (int y = 0; y < off.rows; ++y) {
    for (int x = 0; x < off.cols; ++x) off.at<float>(y, x) = grown.at<uchar>(y, x) ? 0.f : 1.f;
  }
  background += NearestMean(photo - background, off, 3);

  const cv::Mat weight = ForegroundWeight(photo, background, label, inner_px);
  const cv::Mat foreground = NearestMean(photo, weight, 2);
  for (int y = 0; y < out.rows; ++y) {
    for (int x = 0; x < out.cols; ++x) {
      if (!grown.at<uchar>(y, x) || shrunk.at<uchar>(y, x)) continue;
      const cv::Vec3f b = background.at<cv::Vec3f>(y, x);
      const cv::Vec3f axis = foreground.at<cv::Vec3f>(y, x) - b;
      const float length2 = axis.dot(axis);
      if (length2 < 1e-5f) continue;  // no contrast (0.003 of white): the labels stand
      const float alpha = (photo.at<cv::Vec3f>(y, x) - b).dot(axis) / length2;
      out.at<uchar>(y, x) = cv::saturate_cast<uchar>(255 * alpha);
    }
  }
  return coverage;
}

}  // namespace scan
