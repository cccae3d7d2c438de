// Divides a surface into near-flat charts.
#pragma once

#include <stop_token>

#include "drivers/base/progress.h"
#include "drivers/base/result.h"
#include "reconstruction/atlas/surface_graph.h"

namespace scan {

// The faces of each chart, ascending; charts in the order of their first face. Every face that is
// not degenerate is in one chart; every chart is a topological disk.
// Errors: cancelled.
Result<std::vector<std::vector<std::uint32_t>>> GrowCharts(const TriangleMesh& mesh,
                                                           const SurfaceGraph& graph,
                                                           const ProgressFn& progress,
                                                           const std::stop_token& stop);

}  // namespace scan
