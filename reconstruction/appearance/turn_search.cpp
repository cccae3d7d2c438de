#include "reconstruction/appearance/turn_search.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "drivers/base/units.h"

namespace scan {
namespace {

// A map as ranks: each known node's place among `bins` equally filled ones, in [0, bins - 1].
// Nothing where the map has no azimuth at all.
struct RankMap {
  int rings = 0, azimuths = 0;
  std::vector<float> place;   // negative: not known
  std::vector<float> weight;  // area of the node
};

constexpr double kFlat = 1e-5;  // relative spread that is rounding

RankMap RanksOf(RingMap map, const TurningGrid& grid, int ring_step, int bins) {
  double before = 0;
  for (std::size_t i = 0; i < map.size(); ++i)
    if (map.weight[i] > 0) before = std::max(before, std::abs(static_cast<double>(map.value[i])));
  TakeOffRingMeans(map);
  RankMap ranks{map.rings, map.azimuths, std::vector<float>(map.size(), -1.f),
                std::vector<float>(map.size(), 0.f)};
  std::vector<std::size_t> order;
  double squares = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (!(map.weight[i] > 0)) continue;
    order.push_back(i);
    squares += static_cast<double>(map.value[i]) * map.value[i];
    const std::size_t ring =
        std::min(i / static_cast<std::size_t>(map.azimuths) * static_cast<std::size_t>(ring_step),
                 grid.radius_mm.size() - 1);
    ranks.weight[i] = static_cast<float>(grid.radius_mm[ring]);
  }
  if (order.empty() || std::sqrt(squares / static_cast<double>(order.size())) <= kFlat * before)
    return {};
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return map.value[a] < map.value[b]; });
  double total = 0, below = 0;
  for (const std::size_t i : order) total += ranks.weight[i];
  for (const std::size_t i : order) {
    const double rank = (below + 0.5 * ranks.weight[i]) / total;
    ranks.place[i] = static_cast<float>(std::clamp(rank * bins - 0.5, 0.0, bins - 1.0));
    below += ranks.weight[i];
  }
  return ranks;
}

using Histogram = std::vector<double>;  // bins x bins, features down

// Of each band of rings, at one shift (in nodes of these maps).
std::vector<Histogram> BandHistograms(const RankMap& feature, const RankMap& colour, int shift,
                                      int bins, int bands) {
  const auto cells = static_cast<std::size_t>(bins) * static_cast<std::size_t>(bins);
  std::vector<Histogram> histograms(static_cast<std::size_t>(bands), Histogram(cells, 0.0));
  const int n = feature.azimuths;
  for (int j = 0; j < feature.rings; ++j) {
    Histogram& h = histograms[static_cast<std::size_t>(j * bands / feature.rings)];
    for (int k = 0; k < n; ++k) {
      const auto f = static_cast<std::size_t>(j * n + k);
      const auto c = static_cast<std::size_t>(j * n + (k + shift) % n);
      const float x = feature.place[f], y = colour.place[c];
      if (x < 0 || y < 0) continue;
      const int u = std::min(static_cast<int>(x), bins - 2),
                v = std::min(static_cast<int>(y), bins - 2);
      const double s = x - static_cast<float>(u), t = y - static_cast<float>(v);
      const double w = colour.weight[c];
      double* cell = h.data() + u * bins + v;
      cell[0] += w * (1 - s) * (1 - t);
      cell[1] += w * (1 - s) * t;
      cell[bins] += w * s * (1 - t);
      cell[bins + 1] += w * s * t;
    }
  }
  return histograms;
}

// Nats. Every count so small that it moves nothing is left out.
double Information(const Histogram& h, int bins) {
  std::vector<double> rows(static_cast<std::size_t>(bins), 0.0), columns = rows;
  double total = 0;
  for (std::size_t i = 0; i < h.size(); ++i) {
    rows[i / rows.size()] += h[i];
    columns[i % rows.size()] += h[i];
    total += h[i];
  }
  double sum = 0;
  for (std::size_t i = 0; i < h.size(); ++i)
    if (h[i] > 1e-12 * total)
      sum += h[i] * std::log(h[i] * total / (rows[i / rows.size()] * columns[i % rows.size()]));
  return total > 0 ? sum / total : 0;
}

// Per shift: of all bands, and of all but each one.
struct Curves {
  std::vector<int> shifts;
  std::vector<double> all;
  std::vector<std::vector<double>> without;  // [band][shift]
};

Curves CurvesOf(std::span<const RankMap> features, std::span<const RankMap> colours,
                std::vector<int> shifts, const TurnSearchOptions& options) {
  const auto bands = static_cast<std::size_t>(options.bands);
  Curves curves{std::move(shifts), {}, {}};
  curves.all.assign(curves.shifts.size(), 0.0);
  curves.without.assign(bands, curves.all);
  tbb::parallel_for(std::size_t{0}, curves.shifts.size(), [&](std::size_t i) {
    for (const RankMap& feature : features) {
      for (const RankMap& colour : colours) {
        const auto parts =
            BandHistograms(feature, colour, curves.shifts[i], options.bins, options.bands);
        Histogram all(parts[0].size(), 0.0);
        for (const Histogram& part : parts)
          for (std::size_t q = 0; q < all.size(); ++q) all[q] += part[q];
        curves.all[i] += Information(all, options.bins);
        for (std::size_t b = 0; b < bands; ++b) {
          Histogram rest = all;
          for (std::size_t q = 0; q < all.size(); ++q)
            rest[q] = std::max(0.0, rest[q] - parts[b][q]);
          curves.without[b][i] += Information(rest, options.bins);
        }
      }
    }
  });
  return curves;
}

double MedianOf(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Standard error of a statistic from its values with one band left out.
double JackknifeError(std::span<const double> without) {
  const auto n = static_cast<double>(without.size());
  const double mean = std::accumulate(without.begin(), without.end(), 0.0) / n;
  double squares = 0;
  for (const double value : without) squares += (value - mean) * (value - mean);
  return std::sqrt((n - 1) / n * squares);
}

// Places on the circle that belong to the peak at `peak`: down to half its height on both sides,
// and as far again.
std::vector<bool> Lobe(std::span<const double> curve, std::size_t peak, double floor) {
  const std::size_t n = curve.size();
  std::vector<bool> lobe(n, false);
  const double half = 0.5 * (curve[peak] + floor);
  for (const std::size_t step : {std::size_t{1}, n - 1}) {
    std::size_t width = 0;
    for (std::size_t at = peak; width < n / 2 && curve[at] >= half; at = (at + step) % n) ++width;
    for (std::size_t d = 0, at = peak; d <= 2 * width && d < n / 2; ++d, at = (at + step) % n)
      lobe[at] = true;
  }
  return lobe;
}

// Of the parabola through the values; the values' middle where they do not bend down.
double TopOf(std::span<const int> x, std::span<const double> y) {
  double s0 = 0, s2 = 0, s4 = 0, t0 = 0, t1 = 0, t2 = 0;
  double middle = 0;
  for (const int value : x) middle += value;
  middle /= static_cast<double>(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double u = x[i] - middle, u2 = u * u;
    s0 += 1, s2 += u2, s4 += u2 * u2;
    t0 += y[i], t1 += y[i] * u, t2 += y[i] * u2;
  }
  const double bend = (s0 * t2 - s2 * t0) / (s0 * s4 - s2 * s2), slope = t1 / s2;
  if (!(bend < 0)) return middle;
  return middle + std::clamp(-0.5 * slope / bend, -s0, s0);
}

constexpr int kCoarse = 4, kCoarseRings = 2;  // nodes in a cell of the search over the circle

std::vector<RankMap> AllRanks(const TurningGrid& grid, std::span<const RingMap> maps, int rings,
                              int azimuths, const TurnSearchOptions& options) {
  std::vector<RankMap> ranks;
  for (const RingMap& map : maps) {
    RankMap r = RanksOf(Reduced(map, rings, azimuths), grid, rings, options.bins);
    if (!r.place.empty()) ranks.push_back(std::move(r));
  }
  return ranks;
}

// Judges the coarse curve: score, runner-up and gap.
std::size_t JudgePeak(const Curves& coarse, TurnEstimate& found) {
  const std::size_t n = coarse.all.size();
  const auto peak = static_cast<std::size_t>(
      std::max_element(coarse.all.begin(), coarse.all.end()) - coarse.all.begin());
  const double floor = MedianOf(coarse.all);
  const std::vector<bool> lobe = Lobe(coarse.all, peak, floor);
  std::vector<double> rest;
  for (std::size_t i = 0; i < n; ++i)
    if (!lobe[i]) rest.push_back(coarse.all[i]);
  if (rest.size() < n / 4) return peak;  // as wide as the circle: score and gap stay 0
  const double mean =
      std::accumulate(rest.begin(), rest.end(), 0.0) / static_cast<double>(rest.size());
  double squares = 0;
  for (const double value : rest) squares += (value - mean) * (value - mean);
  found.score = (coarse.all[peak] - mean) /
                std::max(std::sqrt(squares / static_cast<double>(rest.size())), 1e-12);
  // Bands may agree on an advantage too small to mean anything: ranks break ties in order.
  const double least_error = std::max(0.03 * (coarse.all[peak] - mean), 1e-12);
  found.gap = std::numeric_limits<double>::infinity();
  double runner_up = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < n; ++i) {
    if (lobe[i]) continue;
    std::vector<double> advantage;
    for (const auto& without : coarse.without) advantage.push_back(without[peak] - without[i]);
    const double error = std::max(JackknifeError(advantage), least_error);
    found.gap = std::min(found.gap, (coarse.all[peak] - coarse.all[i]) / error);
    if (coarse.all[i] <= runner_up) continue;
    runner_up = coarse.all[i];
    found.runner_up_rad = 2 * kPi * static_cast<double>(i) / static_cast<double>(n);
  }
  return peak;
}

std::string WhyUndecided(const TurnEstimate& found, const TurnSearchOptions& options) {
  if (found.score < options.least_score)
    return fmt::format("no turn stands out of the circle (score {:.1f}, {:.1f} needed)",
                       found.score, options.least_score);
  if (found.gap < options.least_gap)
    return fmt::format(
        "parts of the surface do not agree on one turn, or the turn {:.1f} deg from it fits as "
        "well (advantage {:.1f} standard errors, {:.1f} needed)",
        DegFromRad(std::abs(std::remainder(found.runner_up_rad - found.turn_rad, 2 * kPi))),
        found.gap, options.least_gap);
  if (!(found.sigma_rad < options.largest_sigma_rad))
    return fmt::format("the best turn is known to {:.1f} deg only", DegFromRad(found.sigma_rad));
  return {};
}

}  // namespace

struct TurnSearch::Ranked {
  std::vector<RankMap> coarse, fine;

  static Ranked Of(const TurningGrid& grid, std::span<const RingMap> maps,
                   const TurnSearchOptions& options) {
    std::vector<RingMap> smooth;
    for (const RingMap& map : maps) smooth.push_back(Smoothed(map, grid, options.smoothing_mm));
    return {AllRanks(grid, smooth, kCoarseRings, kCoarse, options),
            AllRanks(grid, smooth, 1, 1, options)};
  }
};

TurnSearch::TurnSearch(const TurningGrid& grid, std::span<const RingMap> features,
                       const TurnSearchOptions& options)
    : grid_(grid),
      options_(options),
      features_(std::make_unique<const Ranked>(Ranked::Of(grid, features, options))) {}
TurnSearch::~TurnSearch() = default;

TurnEstimate TurnSearch::Find(std::span<const RingMap> colours) const {
  TurnEstimate found;
  const Ranked ranked = Ranked::Of(grid_, colours, options_);
  if (features_->coarse.empty() || ranked.coarse.empty()) {
    found.reason =
        ranked.coarse.empty() ? "the colour is the same all round" : "the CT is the same all round";
    return found;
  }
  std::vector<int> shifts(static_cast<std::size_t>(grid_.azimuths / kCoarse));
  std::iota(shifts.begin(), shifts.end(), 0);
  const Curves coarse = CurvesOf(features_->coarse, ranked.coarse, shifts, options_);
  const std::size_t peak = JudgePeak(coarse, found);
  const double floor = MedianOf(coarse.all);
  for (const double value : coarse.all) found.curve.push_back(value - floor);

  constexpr int kReach = 2 * kCoarse;  // nodes on both sides of the peak
  const int middle = static_cast<int>(peak) * kCoarse;
  shifts.clear();
  for (int d = -kReach; d <= kReach; ++d)
    shifts.push_back((middle + d + grid_.azimuths) % grid_.azimuths);
  const Curves fine = CurvesOf(features_->fine, ranked.fine, shifts, options_);
  std::vector<int> around(shifts.size());
  std::iota(around.begin(), around.end(), middle - kReach);
  found.turn_rad = std::remainder(TopOf(around, fine.all) * grid_.step_rad(), 2 * kPi);
  std::vector<double> tops;
  for (const auto& without : fine.without)
    tops.push_back(TopOf(around, without) * grid_.step_rad());
  found.sigma_rad = JackknifeError(tops);
  found.reason = WhyUndecided(found, options_);
  found.decided = found.reason.empty();
  return found;
}

}  // namespace scan
