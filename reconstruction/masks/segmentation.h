// The steps of making a mask.
#pragma once

#include <opencv2/core.hpp>

#include "reconstruction/masks/make_masks.h"

namespace scan {

// sRGB 8-bit to linear light, CV_32FC3 in [0, 1].
cv::Mat LinearOf(const cv::Mat& srgb);

// How far each pixel is from being background.
struct Difference {
  cv::Mat normalised;    // CV_32FC3, photo - plate in standard deviations of background
  cv::Mat evidence;      // CV_32F, log-likelihood of specimen over background, nats
  cv::Mat plate_linear;  // CV_32FC3, the plate at the photograph's exposure
};
Difference DifferenceToPlate(const cv::Mat& photo, const cv::Mat& plate, const cv::Mat& ignore,
                             double noise_floor);

// Binary labels (CV_8U, 0 or 255): evidence > 0, with a minimum cut in the band around its edge.
// `contrast` (CV_32FC3) is the picture whose steps attract the boundary.
cv::Mat CutBand(const cv::Mat& evidence, const cv::Mat& contrast, const cv::Mat& initial,
                const MaskOptions& options);

// Drops specks and closes tiny holes.
void CleanLabels(cv::Mat& labels, const MaskOptions& options);

// GrabCut on a reduced picture; labels CV_8U, 0 or 255, at full size.
cv::Mat GrabCutLabels(const cv::Mat& photo, const cv::Mat& ignore, const MaskOptions& options);

// Background seen through the specimen's rim: smooth continuation of what lies outside the labels.
cv::Mat BackgroundFromPhoto(const cv::Mat& photo_linear, const cv::Mat& labels, int margin_px);

// Coverage (CV_8U) from labels: the mixture of foreground and background within a few pixels of
// their edge. `outer_px` and `inner_px`: how far from the labels' edge coverage may be partial.
cv::Mat CoverageFromLabels(const cv::Mat& photo_linear, const cv::Mat& background_linear,
                           const cv::Mat& labels, int outer_px, int inner_px);

}  // namespace scan
