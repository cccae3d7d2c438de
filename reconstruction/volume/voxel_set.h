// A set of voxels of a volume, and what is done to it whole: boxes of neighbours, components.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace scan {

// One byte a voxel, 0 or 1, i fastest, as in Volume::grey.
struct VoxelSet {
  std::array<std::size_t, 3> size{0, 0, 0};
  std::vector<std::uint8_t> inside;

  std::size_t index(std::size_t i, std::size_t j, std::size_t k) const {
    return i + size[0] * (j + size[1] * k);
  }
};

std::size_t Count(const VoxelSet& set);

// Minkowski sum and difference with a cube of 2 radius + 1 voxels a side; for Eroded the space
// outside of the volume counts as inside. Same bytes for any number of threads.
VoxelSet Dilated(const VoxelSet& set, int radius);
VoxelSet Eroded(const VoxelSet& set, int radius);

enum class Connectivity { faces, edges, corners };  // 6, 18 or 26 neighbours

struct Component {
  std::size_t voxels = 0;
  bool side_wall = false;  // touches a face of the volume other than the first and last slice
  bool any_wall = false;
};

// label[v] = 0 outside, 1 + index into `components` inside; components in the order of their first
// voxel.
struct Labelling {
  std::vector<std::uint32_t> label;
  std::vector<Component> components;
};
Labelling LabelComponents(const VoxelSet& set, Connectivity connectivity);

// Index of the component with the most voxels, the first of equals; -1 without any.
std::ptrdiff_t LargestOf(const Labelling& labelling);

// Voxels outside of `set` that no path of face neighbours outside of `set` joins to the border of
// the volume.
VoxelSet EnclosedCavities(const VoxelSet& set);

}  // namespace scan
