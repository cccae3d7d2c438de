// What the CT shows of the surface, for comparison with its colour.
#pragma once

#include <string>
#include <vector>

#include "reconstruction/appearance/ring_map.h"
#include "reconstruction/appearance/turning_grid.h"
#include "reconstruction/mesh/bvh.h"
#include "reconstruction/volume/volume.h"

namespace scan {

struct SurfaceFeature {
  std::string name;
  RingMap map;
};

struct FeatureOptions {
  // Bounds of the layers under the surface whose mean grey is taken, in shares of the largest
  // radius.
  std::vector<double> depths{0.02, 0.06, 0.12, 0.25, 0.45};
  int samples_per_layer = 6;
  double occlusion_reach = 1.0;  // rays, in shares of the largest radius
};

// Density under the surface (where there is a volume, model frame), curvature beyond that of the
// profile, ambient occlusion (share of the cosine-weighted sky that the mesh hides). Thread
// contract: pure; parallel inside; the same bytes for any number of threads.
std::vector<SurfaceFeature> SurfaceFeatures(const TurningGrid& grid, const MeshBvh& bvh,
                                            const Volume* volume,
                                            const FeatureOptions& options = {});

}  // namespace scan
