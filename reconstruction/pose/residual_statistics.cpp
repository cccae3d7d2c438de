#include "reconstruction/pose/residual_statistics.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace scan {
namespace {

constexpr double kBinPx = 4;  // of lags
constexpr int kBins = 250;

struct Lags {
  std::vector<double> product = std::vector<double>(kBins, 0.0);
  std::vector<double> count = std::vector<double>(kBins, 0.0);
};

// Sums of products of all pairs of one view, each view in units of its own variance.
void Add(std::span<const ContourMatch> matches, Lags& lags) {
  const double sigma = RobustSigma(matches);
  if (!(sigma > 0)) return;
  struct Residual {
    double arc_px, value;
  };
  std::vector<Residual> residuals;
  residuals.reserve(matches.size());
  for (const ContourMatch& m : matches)
    residuals.push_back({m.arc_px, std::clamp(m.residual_px, -3 * sigma, 3 * sigma) / sigma});
  std::sort(residuals.begin(), residuals.end(),
            [](const Residual& a, const Residual& b) { return a.arc_px < b.arc_px; });
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    for (std::size_t j = i; j < residuals.size(); ++j) {
      const double lag = residuals[j].arc_px - residuals[i].arc_px;
      const auto bin = static_cast<std::size_t>(j == i ? 0 : 1 + lag / kBinPx);
      if (bin >= kBins) break;
      lags.product[bin] += residuals[i].value * residuals[j].value;
      lags.count[bin] += 1;
    }
  }
}

}  // namespace

double CorrelationLength(std::span<const std::span<const ContourMatch>> views) {
  constexpr double kLeast = 0.05;
  Lags lags;
  for (const auto& view : views) Add(view, lags);
  if (!(lags.count[0] > 0)) return 0;
  const double variance = lags.product[0] / lags.count[0];  // bin 0: each with itself
  if (!(variance > 0)) return 0;
  double length_px = 0;
  for (std::size_t bin = 1; bin < kBins; ++bin) {
    if (lags.count[bin] == 0) continue;
    const double correlation = lags.product[bin] / lags.count[bin] / variance;
    if (correlation < kLeast) break;
    length_px += 2 * kBinPx * correlation;
  }
  return length_px;
}

double CorrelationBetweenViews(std::span<const ViewResiduals> views, double place_mm,
                               double correlation_px) {
  struct Mean {
    double length_px = 0, value = 0;
  };
  struct Sums {  // over the views of one place; those over pairs follow
    double weight = 0, value = 0, weight2 = 0, value2 = 0;
  };
  std::map<SurfacePlace, Sums> places;
  for (const ViewResiduals& view : views) {
    const double sigma = RobustSigma(view.matches);
    if (!(sigma > 0)) continue;
    std::map<SurfacePlace, Mean> means;
    for (const ContourMatch& m : view.matches) {
      Mean& mean = means[PlaceOf(view.state, m, place_mm)];
      mean.length_px += m.share_px;
      mean.value += m.share_px * std::clamp(m.residual_px / sigma, -3.0, 3.0);
    }
    for (const auto& [place, mean] : means) {
      if (!(mean.length_px > 0)) continue;
      const double weight = std::min(1.0, mean.length_px / correlation_px);
      const double value = weight * mean.value / mean.length_px;
      Sums& sums = places[place];
      sums.weight += weight;
      sums.value += value;
      sums.weight2 += weight * weight;
      sums.value2 += value * value;
    }
  }
  double products = 0, pairs = 0, squares = 0, count = 0;
  for (const auto& [place, sums] : places) {
    products += sums.value * sums.value - sums.value2;
    pairs += sums.weight * sums.weight - sums.weight2;
    squares += sums.value2;
    count += sums.weight2;
  }
  if (!(pairs > 0) || !(squares > 0)) return 0;
  const double share = products / pairs / (squares / count);
  const double standard_error = std::sqrt(2 / pairs);  // each pair is in it twice
  return share > 2 * standard_error ? std::min(share, 1.0) : 0;
}

}  // namespace scan
