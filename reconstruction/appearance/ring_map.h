// A quantity over the nodes of a TurningGrid.
#pragma once

#include <span>
#include <vector>

#include "reconstruction/appearance/turning_grid.h"

namespace scan {

// Weight 0: not known there (the value is then of no matter).
struct RingMap {
  int rings = 0, azimuths = 0;
  std::vector<float> value, weight;

  int index(int ring, int azimuth) const { return ring * azimuths + azimuth; }
  std::size_t size() const { return value.size(); }
};
RingMap MakeRingMap(const TurningGrid& grid);

// Mean under a Gaussian of `sigma_mm` on the surface, known values only; a node without a value
// stays without one.
RingMap Smoothed(const RingMap& map, const TurningGrid& grid, double sigma_mm);

// Cells of `rings` x `azimuths` nodes. Precondition: `azimuths` divides the map's.
RingMap Reduced(const RingMap& map, int rings, int azimuths);

// Takes off each ring's mean: what is the same all round tells no azimuth.
void TakeOffRingMeans(RingMap& map);

// Value at a fractional azimuth, linear between nodes; weight 0 where a neighbour is not known.
struct MapSample {
  float value = 0, weight = 0, slope = 0;  // slope: per node
};
MapSample SampleRing(const RingMap& map, int ring, double azimuth);

}  // namespace scan
