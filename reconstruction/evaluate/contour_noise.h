// Silhouettes with the errors that masks of photographs have: outlines that stray and swell.
#pragma once

#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "drivers/base/rng.h"
#include "reconstruction/masks/contour.h"

namespace scan {

struct ContourNoise {
  double sigma_px = 0;        // along the normal
  double correlation_px = 4;  // integral of the autocorrelation along the contour, both sides
  double bias_px = 0;         // outward positive
  bool binary = false;        // pixels are taken in or left out as a whole

  bool displaces() const { return sigma_px > 0 || bias_px != 0; }
};

// Each contour at points 0.5 px apart, moved along their normals by the bias and a stationary
// Gaussian process of arc length. Its autocorrelation is a Gaussian; both sides of a thin part
// stray independently. Preconditions: correlation_px > 0, closed contours.
std::vector<Contour> DisplacedContours(std::span<const Contour> contours, const ContourNoise& noise,
                                       Rng& rng);

// CV_8U, share of each pixel inside the contours, by their winding number: overlapping pieces of a
// contour count once, pieces turned inside out do not. Exact along rows, 16 lines a pixel.
// Precondition: outer contours clockwise on the screen, holes the other way.
cv::Mat CoverageOfContours(std::span<const Contour> contours, cv::Size size);

}  // namespace scan
