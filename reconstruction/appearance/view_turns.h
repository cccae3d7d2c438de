// How far each view is turned about the axis against the others, by the colours they share.
#pragma once

#include <span>
#include <vector>

#include "reconstruction/appearance/view_colours.h"

namespace scan {

struct ViewTurnOptions {
  double prior_sigma_rad = 0.1;  // of each view's turn; fixes what is common to all
  // Of the colours, coarse to fine, in nodes where the body is widest. Coarse ones reach far, but
  // are one-sided at the edge of what a view sees: 0.2 deg off at 3 nodes, 0.02 at 1.5.
  std::vector<double> smoothing_nodes{12, 4, 1.5};
  int rounds = 6;  // of Gauss-Newton at each
  int bands = 16;  // of rings, for the sigmas
};

struct ViewTurn {
  double turn_rad = 0;   // to be turned by to agree with the others; their weighted mean is zero
  double sigma_rad = 0;  // infinite where the view shares no colour with another
};

// The colours' maps are shifted so that they agree best: each view's own turn in least squares of
// the differences between views of the same node, the nodes' colours eliminated; sigmas from the
// scatter between bands of rings (what differs along the surface hangs together over many nodes).
// `noise`: of each channel, its weight. A pose times a turn by `turn_rad` about the axis agrees.
// Thread contract: pure; parallel inside; the same bytes for any number of threads.
std::vector<ViewTurn> ViewTurns(const TurningGrid& grid, std::span<const ViewColours> views,
                                const std::array<double, kColourChannels>& noise,
                                const ViewTurnOptions& options = {});

// The colours of the view after its pose was turned: `turn_rad` further along the azimuth.
ViewColours Turned(const ViewColours& view, double turn_rad);

}  // namespace scan
