#include "reconstruction/texture/merge.h"

#include <maxflow.h>

#include <algorithm>
#include <cmath>

#include "reconstruction/texture/texture.h"

namespace scan {
namespace {

constexpr float kHard = 1e6f;           // stands for infinity beside costs below 4 a pair
constexpr float kNormalWeight = 0.01f;  // Ijiri 2018, Eq 8, as weighted by its authors
constexpr int kBlock = 4;

enum class Side : std::uint8_t { neither, result_only, layer_only, both };

// What a texel is in one cut.
struct Label {
  enum : std::int32_t { outside = -1, from_result = -2, from_layer = -3 };
};

struct Cut {
  const Texels& texels;
  const Layer& result;
  const Layer& layer;
  std::vector<Side> side;
  std::vector<float> mismatch;  // |I_A(p) - I_B(p)|, RGB in [0, 1], L2

  // Ijiri 2018, Eq 7 as in Kwatra et al. 2003.
  float PairCost(std::size_t p, std::size_t q) const { return mismatch[p] + mismatch[q]; }
};

Cut Prepare(const Texels& texels, const Layer& result, const Layer& layer) {
  Cut cut{texels, result, layer, std::vector<Side>(texels.size(), Side::neither),
          std::vector<float>(texels.size(), 0.f)};
  for (std::size_t i = 0; i < texels.size(); ++i) {
    const bool a = result.view[i] != kNoView, b = layer.view[i] != kNoView;
    cut.side[i] = a ? (b ? Side::both : Side::result_only) : b ? Side::layer_only : Side::neither;
    if (!(a && b)) continue;
    float squares = 0;
    for (int c = 0; c < 3; ++c) {
      const float d = (static_cast<float>(result.colour[i][c]) - layer.colour[i][c]) / 65535.f;
      squares += d * d;
    }
    cut.mismatch[i] = std::sqrt(squares);
  }
  return cut;
}

// Minimum cut over the nodes; texels with the same node share a label. `node` is overwritten with
// Label::from_result or from_layer.
void Solve(const Cut& cut, int nodes, std::vector<std::int32_t>& node) {
  if (nodes == 0) return;
  maxflow::Graph_FFF graph(nodes, 2 * nodes);
  graph.add_node(nodes);
  for (std::size_t p = 0; p < node.size(); ++p) {
    const std::int32_t n = node[p];
    if (n < 0) continue;
    bool beside_result = false, beside_layer = false;
    float source = kNormalWeight * std::max(0.f, cut.result.cosine[p]);  // Eq 8, cosine = -I^n
    float sink = kNormalWeight * std::max(0.f, cut.layer.cosine[p]);
    cut.texels.VisitNeighbours(p, [&](std::int32_t neighbour) {
      const auto q = static_cast<std::size_t>(neighbour);
      beside_result |= cut.side[q] == Side::result_only;
      beside_layer |= cut.side[q] == Side::layer_only;
      if (node[q] == Label::from_result) source += cut.PairCost(p, q);
      if (node[q] == Label::from_layer) sink += cut.PairCost(p, q);
      if (node[q] >= 0 && node[q] != n && p < q) {
        const float cost = cut.PairCost(p, q);
        graph.add_edge(n, node[q], cost, cost);
      }
    });
    if (beside_result && !beside_layer) source += kHard;
    if (beside_layer && !beside_result) sink += kHard;
    graph.add_tweights(n, source, sink);
  }
  graph.maxflow();
  for (std::int32_t& n : node) {
    if (n < 0) continue;
    n = graph.what_segment(n, maxflow::Graph_FFF::SOURCE) == maxflow::Graph_FFF::SOURCE
            ? Label::from_result
            : Label::from_layer;
  }
}

// Block of each texel that both show: 4 x 4 places of the atlas that are joined to each other.
std::vector<std::int32_t> Blocks(const Cut& cut, int& count) {
  const Texels& texels = cut.texels;
  std::vector<std::int32_t> node(texels.size(), Label::outside);
  auto block = [&](std::size_t i) {
    const int x = texels.place[i] % texels.size_px, y = texels.place[i] / texels.size_px;
    return std::pair(x / kBlock, y / kBlock);
  };
  count = 0;
  std::vector<std::size_t> stack;
  for (std::size_t i = 0; i < texels.size(); ++i) {
    if (cut.side[i] != Side::both || node[i] != Label::outside) continue;
    const auto home = block(i);
    node[i] = count;
    stack.assign(1, i);
    while (!stack.empty()) {
      const std::size_t p = stack.back();
      stack.pop_back();
      for (const std::int32_t q : texels.beside[p]) {
        if (q < 0 || cut.side[q] != Side::both || node[q] != Label::outside || block(q) != home) {
          continue;
        }
        node[q] = count;
        stack.push_back(q);
      }
    }
    ++count;
  }
  return node;
}

std::vector<std::int32_t> Labels(const Cut& cut) {
  int blocks = 0;
  const std::vector<std::int32_t> block = Blocks(cut, blocks);
  std::vector<std::int32_t> label = block;
  Solve(cut, blocks, label);
  std::vector<std::uint8_t> beside_cut(blocks, 0);
  for (std::size_t p = 0; p < label.size(); ++p) {
    if (block[p] < 0) continue;
    cut.texels.VisitNeighbours(p, [&](std::int32_t q) {
      if (block[q] >= 0 && label[q] != label[p]) beside_cut[block[p]] = 1;
    });
  }
  int nodes = 0;
  std::vector<std::int32_t> node = label;
  for (std::size_t p = 0; p < label.size(); ++p) {
    if (block[p] >= 0 && beside_cut[block[p]]) node[p] = nodes++;
  }
  Solve(cut, nodes, node);
  return node;
}

// Steps from the seam of each texel on either side of it, below `reach`; -1 farther away.
std::vector<std::int16_t> StepsFromSeam(const Cut& cut, const std::vector<std::int32_t>& label,
                                        int reach, SeamSummary& summary) {
  std::vector<std::int16_t> steps(label.size(), -1);
  std::vector<std::size_t> front, next;
  for (std::size_t p = 0; p < label.size(); ++p) {
    if (cut.side[p] != Side::both) continue;
    bool on_seam = false;
    cut.texels.VisitNeighbours(p, [&](std::int32_t neighbour) {
      const auto q = static_cast<std::size_t>(neighbour);
      if (cut.side[q] != Side::both || label[q] == label[p]) return;
      on_seam = true;
      if (p < q) {
        ++summary.pairs;
        summary.cost += cut.PairCost(p, q);
      }
    });
    if (!on_seam || reach == 0) continue;
    steps[p] = 0;
    front.push_back(p);
  }
  for (std::int16_t step = 1; step < reach && !front.empty(); ++step) {
    next.clear();
    for (const std::size_t p : front) {
      cut.texels.VisitNeighbours(p, [&](std::int32_t q) {
        if (steps[q] >= 0 || cut.side[q] != Side::both || label[q] != label[p]) return;
        steps[q] = step;
        next.push_back(q);
      });
    }
    front.swap(next);
  }
  return steps;
}

}  // namespace

void MergeBestView(const Layer& layer, Layer& result) {
  for (std::size_t i = 0; i < result.view.size(); ++i) {
    if (layer.view[i] == kNoView || layer.cosine[i] <= result.cosine[i]) continue;
    result.colour[i] = layer.colour[i];
    result.cosine[i] = layer.cosine[i];
    result.view[i] = layer.view[i];
    result.kind[i] = layer.kind[i];
  }
}

SeamSummary MergeBySeam(const Texels& texels, const Layer& layer, int feather, Layer& result) {
  SeamSummary summary;
  const Cut cut = Prepare(texels, result, layer);
  const std::vector<std::int32_t> label = Labels(cut);
  const std::vector<std::int16_t> steps = StepsFromSeam(cut, label, feather, summary);
  for (std::size_t i = 0; i < texels.size(); ++i) {
    const bool take = cut.side[i] == Side::layer_only || label[i] == Label::from_layer;
    if (cut.side[i] == Side::both && steps[i] >= 0) {
      // Half of each at the seam, its own alone `feather` texels away; mixed in linear light.
      const float other =
          0.5f * (1 - (static_cast<float>(steps[i]) + 0.5f) / static_cast<float>(feather));
      const float of_layer = take ? 1 - other : other;
      result.colour[i] = CodesOfLinear(LinearOfCodes(result.colour[i]) * (1 - of_layer) +
                                       LinearOfCodes(layer.colour[i]) * of_layer);
      result.kind[i] = static_cast<std::uint16_t>(TexelClass::blended);
    } else if (take) {
      result.colour[i] = layer.colour[i];
      result.kind[i] = layer.kind[i];
    }
    if (take) {
      result.cosine[i] = layer.cosine[i];
      result.view[i] = layer.view[i];
    }
  }
  return summary;
}

}  // namespace scan
