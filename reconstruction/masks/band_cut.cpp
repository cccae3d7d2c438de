#include <maxflow.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "reconstruction/masks/segmentation.h"

namespace scan {
namespace {

struct Step {
  int dx, dy;
  float length;
};
constexpr std::array<Step, 4> kForward = {
    {{1, 0, 1.f}, {0, 1, 1.f}, {1, 1, 1.41421356f}, {-1, 1, 1.41421356f}}};

float SquaredStep(const cv::Vec3f& a, const cv::Vec3f& b) {
  const cv::Vec3f d = a - b;
  return d.dot(d);
}

cv::Mat BandAround(const cv::Mat& labels, int band_px) {
  const cv::Mat box =
      cv::getStructuringElement(cv::MORPH_RECT, cv::Size(2 * band_px + 1, 2 * band_px + 1));
  cv::Mat grown, shrunk, band;
  cv::dilate(labels, grown, box);
  cv::erode(labels, shrunk, box);
  cv::subtract(grown, shrunk, band);
  return band;
}

}  // namespace

cv::Mat CutBand(const cv::Mat& evidence, const cv::Mat& contrast, const cv::Mat& initial,
                const MaskOptions& options) {
  const cv::Mat band = BandAround(initial, options.band_px);
  cv::Mat node(band.size(), CV_32S, cv::Scalar(-1));
  int nodes = 0;
  double squares = 0;
  std::size_t pairs = 0;
  for (int y = 0; y < band.rows; ++y) {
    for (int x = 0; x < band.cols; ++x) {
      if (!band.at<uchar>(y, x)) continue;
      node.at<int>(y, x) = nodes++;
      if (x + 1 < band.cols) {
        squares += SquaredStep(contrast.at<cv::Vec3f>(y, x), contrast.at<cv::Vec3f>(y, x + 1));
        ++pairs;
      }
    }
  }
  cv::Mat labels = initial.clone();
  if (nodes == 0) return labels;
  // Boykov and Jolly 2001: weights fall with the contrast, beta = 1 / (2 mean square step).
  const double beta =
      1 / (2 * std::max(1e-9, squares / static_cast<double>(std::max<std::size_t>(1, pairs))));
  maxflow::Graph_FFF graph(nodes, 4 * nodes);
  graph.add_node(nodes);
  const cv::Rect frame(0, 0, band.cols, band.rows);
  for (int y = 0; y < band.rows; ++y) {
    for (int x = 0; x < band.cols; ++x) {
      const int p = node.at<int>(y, x);
      if (p >= 0) {
        const float e = evidence.at<float>(y, x);
        graph.add_tweights(p, std::max(0.f, e), std::max(0.f, -e));  // source = specimen
      }
      for (const Step& step : kForward) {
        const cv::Point to(x + step.dx, y + step.dy);
        if (!frame.contains(to)) continue;
        const int q = node.at<int>(to);
        if (p < 0 && q < 0) continue;
        const auto weight =
            static_cast<float>(options.smoothness / step.length *
                               std::exp(-beta * SquaredStep(contrast.at<cv::Vec3f>(y, x),
                                                            contrast.at<cv::Vec3f>(to))));
        if (p >= 0 && q >= 0) {
          graph.add_edge(p, q, weight, weight);
        } else {  // the pixel outside the band keeps its label
          const bool inside = initial.at<uchar>(p >= 0 ? to : cv::Point(x, y)) != 0;
          graph.add_tweights(p >= 0 ? p : q, inside ? weight : 0, inside ? 0 : weight);
        }
      }
    }
  }
  graph.maxflow();
  for (int y = 0; y < band.rows; ++y) {
    for (int x = 0; x < band.cols; ++x) {
      const int p = node.at<int>(y, x);
      if (p < 0) continue;
      const bool inside =
          graph.what_segment(p, maxflow::Graph_FFF::SINK) == maxflow::Graph_FFF::SOURCE;
      labels.at<uchar>(y, x) = inside ? 255 : 0;
    }
  }
  return labels;
}

void CleanLabels(cv::Mat& labels, const MaskOptions& options) {
  cv::Mat parts, stats, centres;
  int count = cv::connectedComponentsWithStats(labels, parts, stats, centres, 8, CV_32S);
  int largest = 0;
  for (int i = 1; i < count; ++i) largest = std::max(largest, stats.at<int>(i, cv::CC_STAT_AREA));
  const double least = std::max(2.0, options.keep_share * largest);
  for (int y = 0; y < labels.rows; ++y) {
    for (int x = 0; x < labels.cols; ++x) {
      const int part = parts.at<int>(y, x);
      if (part > 0 && stats.at<int>(part, cv::CC_STAT_AREA) < least) labels.at<uchar>(y, x) = 0;
    }
  }
  const cv::Mat outside = 255 - labels;
  cv::connectedComponentsWithStats(outside, parts, stats, centres, 4, CV_32S);
  for (int y = 0; y < labels.rows; ++y) {
    for (int x = 0; x < labels.cols; ++x) {
      const int part = parts.at<int>(y, x);
      if (part > 0 && stats.at<int>(part, cv::CC_STAT_AREA) < options.min_hole_px) {
        labels.at<uchar>(y, x) = 255;
      }
    }
  }
}

}  // namespace scan
