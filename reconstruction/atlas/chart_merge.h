// Joins small charts to their neighbours where the two unfold together.
#pragma once

#include <functional>
#include <stop_token>
#include <vector>

#include "drivers/base/progress.h"
#include "drivers/base/result.h"
#include "reconstruction/atlas/chart_mesh.h"

namespace scan {

// Unfolds a chart; false when it may not be used. Called from several threads.
using UnfoldFn = std::function<bool(ChartMesh&)>;

// Halving a chart that fails at one place leaves crumbs about it. Rounds of disjoint pairs, the
// smallest chart with the neighbour that shares most of its border, are tried until none is left.
// `charts` are unfolded before and after. Same charts for any number of threads.
// Errors: cancelled. Thread contract: pure; parallel inside.
Status MergeSmallCharts(const TriangleMesh& mesh, const SurfaceGraph& graph, const UnfoldFn& unfold,
                        std::vector<ChartMesh>& charts, const ProgressFn& progress,
                        const std::stop_token& stop);

}  // namespace scan
