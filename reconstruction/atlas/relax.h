// Brings an unfolded chart nearer to an isometry.
#pragma once

#include "reconstruction/atlas/chart_mesh.h"

namespace scan {

// Rounds of local rotations and one global solve, from the chart's present uv (mm). False when the
// system cannot be solved; uv is then as before. Faces may flip: check afterwards.
// Source: Liu, Zhang, Xu, Gotsman, Gortler 2008 (as rigid as possible), here with cotangents kept
// positive.
bool Relax(ChartMesh& chart, int rounds);

}  // namespace scan
