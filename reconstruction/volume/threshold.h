// Thresholds found in the histogram of a volume.
#pragma once

#include <vector>

#include "reconstruction/volume/volume.h"

namespace scan {

// Ascending candidates: Otsu's threshold of all voxels, then again of the voxels above it, and so
// on, at most `levels`. Each step takes off the darkest class that is left (air, then fluid, then
// tube ...), so that a specimen of 2 % of the voxels gets a threshold of its own, which the
// simultaneous form of several levels spends on splitting the large classes.
// Grey values; at least one candidate for a volume that holds two different values, else none.
// Thread contract: pure. Source: Otsu 1979, applied recursively (Cheriet, Said, Suen 1998).
std::vector<double> OtsuLevels(const Volume& volume, int levels);

// Mean grey of the voxels below (first) and from (second) the threshold.
struct ClassMeans {
  double below = 0, above = 0;
};
ClassMeans MeansAbout(const Volume& volume, double threshold);

}  // namespace scan
