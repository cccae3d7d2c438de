// From grey values to the voxels of the specimen.
#pragma once

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "drivers/base/progress.h"
#include "drivers/base/result.h"
#include "reconstruction/volume/volume.h"
#include "reconstruction/volume/voxel_set.h"

namespace scan {

struct SegmentOptions {
  std::optional<double> threshold;       // grey value; empty: chosen among OtsuLevels
  std::optional<double> grow_threshold;  // below `threshold`: regions grow from the specimen to it
  int otsu_levels = 8;
  bool drop_side_walls = true;  // what touches a side wall of the volume (tube, holder)
  int opening_radius = 1;       // voxels, >= 0: bridges to the side walls up to 2 r wide are cut
  int closing_radius = 1;       // voxels, >= 0: leaks of a cavity up to 2 r wide count as closed
  bool fill_cavities = true;
};

struct LevelTried {
  double threshold = 0;
  std::size_t above = 0;     // voxels from the threshold on
  std::size_t largest = 0;   // voxels of the largest component away from the side walls
};

struct Segmentation {
  VoxelSet specimen;
  VoxelSet filled;  // of these the voxels of filled cavities and their closed leaks
  double threshold = 0;
  std::vector<LevelTried> levels;  // in the order tried; one where the threshold was given
  std::size_t voxels = 0;
  std::size_t cavity_voxels = 0;
  std::size_t components = 0;             // above the threshold
  std::size_t side_wall_components = 0;   // dropped
  std::size_t side_wall_voxels = 0;       // dropped
  std::size_t small_components = 0;       // dropped: neither largest nor at a side wall
  std::size_t small_voxels = 0;
  std::vector<std::string> notes;  // sentences for the report
};

// The specimen's voxels: threshold, side walls dropped, region growing from the largest component,
// cavities filled.
//
// Without a given threshold the levels of OtsuLevels are tried from the lowest; the first is taken
// at which the largest component away from the side walls holds at least a fifth of all voxels from
// that level on. A specimen in air ends at the first level; one in fluid in a tube at the level
// that takes the fluid away. When no level does (the specimen fills the volume) the first level is
// taken and nothing is dropped.
// Opening: what survives it and touches a side wall claims the voxels nearer to it (along paths
// inside) than to the rest, so that thin legs stay with the specimen and bridges are cut half-way.
// Errors: bad_input for an empty volume, one single grey value, or nothing above the threshold.
// Thread contract: pure; parallel inside, same bytes for any number of threads.
// Source: Otsu 1979; Ijiri 2018, section 4 (threshold and region growing).
Result<Segmentation> Segment(const Volume& volume, const SegmentOptions& options = {},
                             const ProgressFn& progress = {}, std::stop_token stop = {});

}  // namespace scan
