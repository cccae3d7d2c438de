// From grey values to the voxels of the specimen.
#pragma once

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "drivers/base/progress.h"
#include "drivers/base/result.h"
#include "reconstruction/volume/exterior.h"
#include "reconstruction/volume/volume.h"
#include "reconstruction/volume/voxel_set.h"

namespace scan {

struct SegmentOptions {
  std::optional<double> threshold;       // grey value; empty: chosen among OtsuLevels
  std::optional<double> grow_threshold;  // below `threshold`: regions grow from the specimen to it
  bool drop_side_walls = true;           // what touches a side wall of the volume (tube, holder)
  int opening_radius = 1;     // voxels, >= 0: bridges to the side walls up to 2 r wide are cut
  bool fill_cavities = true;  // and all else that the outside does not reach
  ExteriorOptions exterior;   // how it is told
};

// A candidate for the threshold, judged on the volume reduced to at most about two million voxels.
struct LevelTried {
  double threshold = 0;
  std::size_t above = 0;        // voxels from the threshold on
  std::size_t wall = 0;         // of these at the side walls
  std::size_t largest = 0;      // of these in the largest component of the rest
  double inner = 0, outer = 0;  // mean grey a voxel inside and outside of that component's surface
  double contrast = 0;          // (inner - outer) / (inner - darkest class)
  std::size_t cut_faces = 0;    // between that component and what is dropped
  bool plausible = false;
};

struct Segmentation {
  VoxelSet specimen;
  VoxelSet filled;  // of these the voxels of filled cavities and inner spaces
  std::optional<ExteriorOptions> exterior;  // how they were told; empty: none is filled
  double threshold = 0;
  std::vector<LevelTried> levels;  // in ascending order; empty where the threshold was given
  std::size_t voxels_above = 0;    // all from the threshold on
  std::size_t voxels = 0;
  std::size_t cavity_voxels = 0;
  std::size_t components = 0;            // above the threshold
  std::size_t side_wall_components = 0;  // dropped
  std::size_t side_wall_voxels = 0;      // dropped
  std::size_t small_components = 0;      // dropped: neither largest nor at a side wall
  std::size_t small_voxels = 0;
  std::vector<std::string> notes;  // sentences for the report
};

// The specimen's voxels: threshold, side walls dropped, region growing from the largest component,
// inner spaces filled (exterior.h).
//
// Without a given threshold the candidates of OtsuLevels are judged: plausible is one whose largest
// component away from the side walls outweighs the other such components (noise does not) and is a
// twentieth of all that is above, and hangs on the rest by no more than a bridge. Taken is the
// lowest plausible one whose contrast is at least 0.45 of the best: the noise of air and the
// shading of a fluid have none, and a dense core does not win over the softer hull around it. The
// threshold is then the middle of that step. When none is plausible (the specimen fills the
// volume) the first Otsu threshold is taken and nothing is dropped.
// Opening: what survives it and touches a side wall claims the voxels nearer to it (along paths
// inside) than to the rest, so that thin legs stay with the specimen and bridges are cut half-way.
// Errors: bad_input for an empty volume, one single grey value, or nothing above the threshold.
// Thread contract: pure; parallel inside, same bytes for any number of threads.
// Source: Otsu 1979; Ijiri 2018, section 4 (threshold and region growing).
Result<Segmentation> Segment(const Volume& volume, const SegmentOptions& options = {},
                             const ProgressFn& progress = {}, std::stop_token stop = {});

}  // namespace scan
