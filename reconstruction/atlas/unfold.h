// Charts to the plane.
#pragma once

#include "reconstruction/atlas/atlas.h"
#include "reconstruction/atlas/chart_mesh.h"

namespace scan {

// Fills chart.uv, in mm, with the area of the chart preserved in sum; faces counter-clockwise.
// False when the chart is no disk or the solver finds nothing: uv then stays empty.
bool Unfold(ChartMesh& chart, UnfoldMethod method);

// Orthogonal projection along the mean normal; the exact shape for a single face.
void ProjectToPlane(ChartMesh& chart);

// Scales uv so that its area equals the surface's. False when it has none.
bool ScaleToTrueArea(ChartMesh& chart);

}  // namespace scan
