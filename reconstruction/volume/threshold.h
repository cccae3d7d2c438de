// Thresholds found in the histogram of a volume.
#pragma once

#include <vector>

#include "reconstruction/volume/volume.h"

namespace scan {

// Ascending candidates for a threshold: Otsu's of all voxels, then of the voxels on either side of
// it, and so on, `depth` times on the whole and `tail` more times of the brightest class alone.
// Unlike the simultaneous form this also finds a specimen of 2 % of the voxels, on which that form
// spends no level because splitting the large classes (air, fluid) gains more.
// Grey values; none for a volume of one single value.
// Thread contract: pure. Source: Otsu 1979, applied recursively (Cheriet, Said, Suen 1998).
std::vector<double> OtsuLevels(const Volume& volume, int depth, int tail);

// Mean grey of the voxels below (first) and from (second) the threshold.
struct ClassMeans {
  double below = 0, above = 0;
};
ClassMeans MeansAbout(const Volume& volume, double threshold);

}  // namespace scan
