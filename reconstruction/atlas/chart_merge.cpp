#include "reconstruction/atlas/chart_merge.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <numeric>

namespace scan {
namespace {

// Charts below this share of the surface look for a neighbour to join.
constexpr double kSmallShare = 1.0 / 250;
// Neighbours that one chart asks before it is left alone, until it or they change.
constexpr int kMostTries = 4;

struct Chart {
  ChartMesh unfolded;
  double area = 0;
  std::map<std::uint32_t, double> border_mm;  // with each neighbour
  std::vector<std::uint32_t> refused;         // by these neighbours, as they are now
  bool alive = true;
};

struct Pair {
  std::uint32_t small, other;
};

class Merging {
 public:
  Merging(const TriangleMesh& mesh, const SurfaceGraph& graph, std::vector<ChartMesh>&& charts)
      : mesh_(mesh), graph_(graph), charts_(charts.size()) {
    std::vector<std::uint32_t> chart_of(mesh.faces.size(), ~0u);
    for (std::uint32_t c = 0; c < charts.size(); ++c) {
      charts_[c].unfolded = std::move(charts[c]);
      for (const std::uint32_t f : charts_[c].unfolded.faces) {
        chart_of[f] = c;
        charts_[c].area += graph.area[f];
      }
      total_area_ += charts_[c].area;
    }
    for (std::uint32_t f = 0; f < mesh.faces.size(); ++f)
      for (std::size_t k = 0; chart_of[f] != ~0u && k < 3; ++k) {
        const std::int32_t g = graph.links[f][k].face;
        if (g < 0 || chart_of[static_cast<std::size_t>(g)] == chart_of[f]) continue;
        charts_[chart_of[f]].border_mm[chart_of[static_cast<std::size_t>(g)]] +=
            (mesh.vertices[mesh.faces[f][k]] - mesh.vertices[mesh.faces[f][(k + 1) % 3]]).norm();
      }
  }

  // Disjoint pairs, the smallest charts first.
  std::vector<Pair> NextPairs() const {
    std::vector<std::uint32_t> order;
    for (std::uint32_t c = 0; c < charts_.size(); ++c)
      if (charts_[c].alive && charts_[c].area < kSmallShare * total_area_) order.push_back(c);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return charts_[a].area < charts_[b].area;
    });
    std::vector<char> taken(charts_.size(), 0);
    std::vector<Pair> pairs;
    for (const std::uint32_t c : order) {
      if (taken[c]) continue;
      const std::uint32_t other = BestNeighbour(c, taken);
      if (other == ~0u) continue;
      taken[c] = taken[other] = 1;
      pairs.push_back({c, other});
    }
    return pairs;
  }

  bool Try(const Pair& pair, const UnfoldFn& unfold, ChartMesh& joined) const {
    const auto &a = charts_[pair.small].unfolded.faces, &b = charts_[pair.other].unfolded.faces;
    std::vector<std::uint32_t> faces;
    std::merge(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(faces));
    if (!IsDisk(mesh_, graph_, faces)) return false;
    joined = MakeChartMesh(mesh_, graph_, std::move(faces));
    return unfold(joined);
  }

  void Refuse(const Pair& pair) { charts_[pair.small].refused.push_back(pair.other); }

  void Join(const Pair& pair, ChartMesh&& joined) {
    Chart &a = charts_[pair.small], &b = charts_[pair.other];
    b.unfolded = std::move(joined);
    b.area += a.area;
    b.refused.clear();
    a.alive = false;
    a.unfolded = {};
    b.border_mm.erase(pair.small);
    for (const auto& [neighbour, length] : a.border_mm) {
      if (neighbour == pair.other) continue;
      b.border_mm[neighbour] += length;
      charts_[neighbour].border_mm.erase(pair.small);
      charts_[neighbour].border_mm[pair.other] += length;
    }
    for (const auto& [neighbour, length] : b.border_mm)
      std::erase(charts_[neighbour].refused, pair.other);
  }

  std::vector<ChartMesh> Release() {
    std::vector<ChartMesh> out;
    for (Chart& c : charts_)
      if (c.alive) out.push_back(std::move(c.unfolded));
    return out;
  }

 private:
  std::uint32_t BestNeighbour(std::uint32_t c, const std::vector<char>& taken) const {
    const Chart& chart = charts_[c];
    if (std::ssize(chart.refused) >= kMostTries) return ~0u;
    std::uint32_t best = ~0u;
    double longest = 0;
    for (const auto& [neighbour, length] : chart.border_mm) {
      if (length <= longest || std::count(chart.refused.begin(), chart.refused.end(), neighbour))
        continue;
      // What the neighbour asked and was refused need not be asked again from here.
      const auto& by = charts_[neighbour].refused;
      if (std::count(by.begin(), by.end(), c)) continue;
      longest = length;
      best = neighbour;
    }
    return best != ~0u && taken[best] ? ~0u : best;  // it waits for the one it wants
  }

  const TriangleMesh& mesh_;
  const SurfaceGraph& graph_;
  std::vector<Chart> charts_;
  double total_area_ = 0;
};

}  // namespace

Status MergeSmallCharts(const TriangleMesh& mesh, const SurfaceGraph& graph, const UnfoldFn& unfold,
                        std::vector<ChartMesh>& charts, const ProgressFn& progress,
                        const std::stop_token& stop) {
  const auto before = static_cast<double>(charts.size());
  Merging merging(mesh, graph, std::move(charts));
  double joins = 0;
  for (auto pairs = merging.NextPairs(); !pairs.empty(); pairs = merging.NextPairs()) {
    if (stop.stop_requested()) return Cancelled("atlas charts");
    Report(progress, "merge", joins / before);
    std::vector<ChartMesh> joined(pairs.size());
    std::vector<char> good(pairs.size(), 0);
    tbb::parallel_for(std::size_t{0}, pairs.size(),
                      [&](std::size_t p) { good[p] = merging.Try(pairs[p], unfold, joined[p]); });
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      if (good[p]) {
        merging.Join(pairs[p], std::move(joined[p]));
        ++joins;
      } else {
        merging.Refuse(pairs[p]);
      }
    }
  }
  charts = merging.Release();
  return {};
}

}  // namespace scan
