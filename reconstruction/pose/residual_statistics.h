// How far along a contour residuals hang together: they are model discrepancy, not white noise.
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

}  // namespace scan
