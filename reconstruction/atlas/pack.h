// Places charts in the square at one common scale.
#pragma once

#include <stop_token>
#include <vector>

#include "drivers/base/progress.h"
#include "drivers/base/result.h"
#include "reconstruction/atlas/chart_mesh.h"

namespace scan {

struct PackOptions {
  int size_px = 2048;
  int padding_px = 4;  // least distance of two charts; half of it to the border of the square
};

// Turns every chart.uv from mm into [0, 1] with v down, unmirrored seen in the picture, all at the
// same texel density (returned, texels per mm), the largest at which they fit.
// Errors: bad_input when even a tiny scale does not fit; cancelled.
Result<double> PackCharts(std::vector<ChartMesh>& charts, const PackOptions& options,
                          const ProgressFn& progress, const std::stop_token& stop);

}  // namespace scan
