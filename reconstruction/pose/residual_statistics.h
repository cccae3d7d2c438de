// How residuals hang together, along a contour and between views: they are model discrepancy, not
// white noise.
#pragma once

#include <span>
#include <vector>

#include "reconstruction/pose/contour_evidence.h"

namespace scan {

// Integral of the autocorrelation of the residuals over all lags, both sides, in px: the length of
// contour that counts as one independent observation. Pooled over the views; from zero lag to the
// first at which the correlation falls below 0.05. 0 without residuals.
// `views`: each view's matches; residuals beyond three times its robust scale are clipped to that.
// Thread contract: pure.
double CorrelationLength(std::span<const std::span<const ContourMatch>> views);

struct ViewResiduals {
  ViewState state;  // at which they were matched
  std::span<const ContourMatch> matches;
};

// Share of what residuals are at a place of the surface on average that views of the same place
// have in common: mean product of two views' means there over their mean square, each view in units
// of its own robust scale; 0 to 1. Places with less than `correlation_px` of contour count less.
// 0 where it is not twice its own standard error, as with noise of each view's own.
// Precondition: place_mm > 0, correlation_px > 0. Thread contract: pure.
double CorrelationBetweenViews(std::span<const ViewResiduals> views, double place_mm,
                               double correlation_px);

}  // namespace scan
