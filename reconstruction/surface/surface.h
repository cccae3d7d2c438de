// From a CT volume to the specimen's surface: the whole stage.
#pragma once

#include <stop_token>

#include "drivers/base/progress.h"
#include "drivers/base/result.h"
#include "reconstruction/mesh/mesh.h"
#include "reconstruction/surface/clean.h"
#include "reconstruction/surface/decimate.h"
#include "reconstruction/surface/isosurface.h"
#include "reconstruction/volume/segment.h"
#include "reconstruction/volume/volume.h"

namespace scan {

struct SurfaceOptions {
  SegmentOptions segment;
  IsosurfaceOptions isosurface;
  int smoothing_iterations = 10;         // 0: none
  double smoothing_limit_voxels = 0.5;   // of the smallest voxel edge
  double least_component_share = 0.001;  // of the largest component's faces
  DecimateOptions decimate;
};

struct SurfaceResult {
  TriangleMesh mesh;
  Segmentation segmentation;                 // report and voxels
  std::size_t specks = 0, speck_voxels = 0;  // beside the largest piece, left out by Isosurface
  CleanReport clean;
  std::size_t faces_before_decimation = 0;
  double quadric_error_mm = 0, max_deviation_mm = 0, rms_deviation_mm = 0;  // of the decimation
  TopologyReport topology;
};

// segment -> isosurface -> clean -> smooth -> decimate -> check. Model frame, mm; a closed manifold
// whose faces look outward.
// Errors: those of Segment and Decimate; failed when no closed surface comes out; cancelled.
// Thread contract: pure; parallel inside, same bytes for any number of threads.
Result<SurfaceResult> ExtractSurface(const Volume& volume, const SurfaceOptions& options = {},
                                     const ProgressFn& progress = {}, std::stop_token stop = {});

}  // namespace scan
