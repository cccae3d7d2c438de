#include "reconstruction/volume/threshold.h"

#include <algorithm>
#include <cstdint>

namespace scan {
namespace {

constexpr std::size_t kBins = 1024;
constexpr double kTail = 1e-4;
constexpr int kPasses = 6;

struct Histogram {
  double low = 0, width = 1;  // of the first bin's edge, of a bin
  std::vector<double> count = std::vector<double>(kBins, 0.0);
};

// Values beyond fall into the outer bins, so that single hot voxels do not stretch the others.
Histogram Fill(const Volume& volume, double low, double high) {
  Histogram h{low, (high - low) / kBins, std::vector<double>(kBins, 0.0)};
  for (const float g : volume.grey) {
    const double bin = (g - low) / h.width;
    h.count[static_cast<std::size_t>(std::clamp(bin, 0.0, kBins - 1.0))] += 1;
  }
  return h;
}

double Quantile(const Histogram& h, double share, double total) {
  double sum = 0;
  for (std::size_t b = 0; b < kBins; ++b)
    if ((sum += h.count[b]) >= share * total) return h.low + h.width * static_cast<double>(b);
  return h.low + h.width * kBins;
}

// The first bin of the upper class of [from, end); `from` where they hold one class only. On a
// plateau of the criterion (no voxels between the classes) its middle.
std::size_t OtsuBin(const Histogram& h, std::size_t from, std::size_t end) {
  double total = 0, moment = 0;
  for (std::size_t b = from; b < end; ++b) {
    total += h.count[b];
    moment += h.count[b] * static_cast<double>(b);
  }
  double below = 0, below_moment = 0, best = 0;
  std::size_t first = from, last = from;
  for (std::size_t b = from; b + 1 < end; ++b) {
    below += h.count[b];
    below_moment += h.count[b] * static_cast<double>(b);
    const double above = total - below;
    if (below <= 0 || above <= 0) continue;
    const double step = below_moment / below - (moment - below_moment) / above;
    const double between = below * above * step * step;
    if (between > best * (1 + 1e-12)) {
      best = between;
      first = last = b + 1;
    } else if (between >= best * (1 - 1e-12)) {
      last = b + 1;
    }
  }
  return first + (last - first) / 2;
}

void SplitRecursively(const Histogram& h, std::size_t from, std::size_t end, int depth,
                      std::vector<std::size_t>& bins) {
  const std::size_t bin = depth > 0 ? OtsuBin(h, from, end) : from;
  if (bin == from) return;
  bins.push_back(bin);
  SplitRecursively(h, from, bin, depth - 1, bins);
  SplitRecursively(h, bin, end, depth - 1, bins);
}

}  // namespace

std::vector<double> OtsuLevels(const Volume& volume, int depth, int tail) {
  if (volume.grey.empty()) return {};
  const auto [low, high] = std::minmax_element(volume.grey.begin(), volume.grey.end());
  if (!(*high > *low)) return {};
  const double total = static_cast<double>(volume.grey.size());
  Histogram h = Fill(volume, *low, *high);
  for (int pass = 0; pass < kPasses; ++pass) {
    const double q_low = Quantile(h, kTail, total),
                 q_high = Quantile(h, 1 - kTail, total) + h.width;
    if (q_high - q_low > kBins / 4 * h.width) break;
    h = Fill(volume, q_low, q_high);
  }
  std::vector<std::size_t> bins;
  SplitRecursively(h, 0, kBins, depth, bins);
  std::sort(bins.begin(), bins.end());
  for (int n = 0; n < tail && !bins.empty(); ++n) {
    const std::size_t bin = OtsuBin(h, bins.back(), kBins);
    if (bin == bins.back()) break;
    bins.push_back(bin);
  }
  std::vector<double> found;
  for (const std::size_t bin : bins) found.push_back(h.low + h.width * static_cast<double>(bin));
  return found;
}

ClassMeans MeansAbout(const Volume& volume, double threshold) {
  double sum[2] = {0, 0}, count[2] = {0, 0};
  for (const float g : volume.grey) {
    const int side = g >= threshold;
    sum[side] += g;
    count[side] += 1;
  }
  return {count[0] > 0 ? sum[0] / count[0] : threshold,
          count[1] > 0 ? sum[1] / count[1] : threshold};
}

}  // namespace scan
