// Whether an unfolded chart may be used, and how much it is stretched.
#pragma once

#include "reconstruction/atlas/chart_mesh.h"

namespace scan {

// Faces that are clockwise or have no area in the plane.
std::size_t CountFlipped(const ChartMesh& chart);

// Moves inner vertices of flipped faces to the middle of their neighbours, a few rounds.
void Untangle(ChartMesh& chart);

// Whether the border crosses itself; with no flipped face this tells whether the chart overlaps.
bool BorderCrosses(const ChartMesh& chart);

// Sander et al. 2001: singular values of the map from the plane to the surface.
struct FaceStretch {
  double largest = 0, smallest = 0;
  double area = 0;  // mm^2 on the surface
};
std::vector<FaceStretch> StretchOf(const ChartMesh& chart);

// Largest singular value that all but `share` of the area stays below.
double StretchQuantile(std::vector<FaceStretch> stretch, double share);

// Share of the picture's area that faces hold beyond `most` times their area on the surface: spikes
// that the quantile of the stretch does not see.
double WastedShare(const ChartMesh& chart, double most);

}  // namespace scan
