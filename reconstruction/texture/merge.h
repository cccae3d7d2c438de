// One more photograph into the texture so far.
#pragma once

#include "reconstruction/texture/texels.h"

namespace scan {

// Takes each texel from the layer that sees it more squarely.
void MergeBestView(const Layer& layer, Layer& result);

struct SeamSummary {
  std::size_t pairs = 0;
  double cost = 0;  // Eq 7 summed along the seam
};

// Joins both along the minimum cut of Eq 7 and 8 over the texels that both show; the result keeps
// its own on the source side. Solved on blocks of 4 x 4 texels of one chart, with the exact sums of
// the texels' capacities, then texel by texel in the blocks beside the cut: the cost found is at
// most that of the block solution, and usually the global minimum.
SeamSummary MergeBySeam(const Texels& texels, const Layer& layer, int feather_texels,
                        Layer& result);

}  // namespace scan
