// What of the space about a solid is its outside, seen at a scale at which thin walls do not leak.
#pragma once

#include <cstddef>

#include "reconstruction/volume/voxel_set.h"

namespace scan {

struct ExteriorOptions {
  int leak_radius = 2;  // voxels, [0, 11]: gaps of up to 2 r - 1 voxels let nothing through
  int depth = 16;       // voxels, [0, 250]: how far the outside goes on into such gaps
};

// The voxels outside of `solid` that its outside does not reach: cavities, and inner spaces behind
// gaps and pores of their walls.
//
// The outside at the leak's scale is what a ball of leak_radius reaches from beyond the volume.
// From there it goes on into narrower gaps, `depth` voxels along paths of face neighbours, but not
// through a neck into a wider chamber, and as long as it makes no tunnel through what is then left
// as solid (18-connected, its outside 6-connected). So pores become dimples, gaps between two parts
// stay gaps, and handles are only those wide enough for the ball and those of bridges over wider
// gaps. The solid itself is never changed. Measured on an ant of 24 um voxels: Euler number -1260
// becomes 0.
// Thread contract: pure; parallel inside, same bytes for any number of threads.
// Source: opening by reconstruction (Vincent 1993), watershed of the distance map (Beucher, Meyer
// 1993), topological numbers (Bertrand, Malandain 1994).
VoxelSet InnerSpaces(const VoxelSet& solid, const ExteriorOptions& options = {});

}  // namespace scan
