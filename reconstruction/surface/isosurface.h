// The specimen's surface placed on the grey values, not on the staircase of its voxels.
#pragma once

#include "reconstruction/mesh/mesh.h"
#include "reconstruction/volume/segment.h"
#include "reconstruction/volume/volume.h"

namespace scan {

struct IsosurfaceOptions {
  // true: the surface lies half-way between the grey values of the air and of the material nearby;
  // false: at the segmentation's one threshold.
  bool local_threshold = true;
  int window_radius = 2;  // voxels, >= 1: how far "nearby" reaches
};

struct ContouredSurface {
  TriangleMesh mesh;
  std::size_t specks = 0;        // pieces above zero beside the largest, left out
  std::size_t speck_voxels = 0;  // of these
};

// Closed surface of the segmented specimen in the model frame, mm; faces outward.
//
// Flying edges at the zero of F = grey - T. T(v) = (air(v) + material(v)) / 2, the half-way value
// at which a blurred step edge has its true place; material(v) is the mean over the window of
// specimen voxels that do not touch the outside, air(v) of outside voxels that do not touch
// material. Where the window holds no such voxel (blades and legs of two voxels) the segmentation's
// threshold stands. Voxels farther than one from the specimen's own, and those of dropped
// components, are air; filled cavities and voxels deeper than two are material. One layer of air
// around the volume closes the surface there half a voxel beyond the last centre. Where the
// segmentation fills inner spaces, F's largest component is kept and what its outside does not
// reach is filled: one piece, whose handles are those that InnerSpaces leaves. Precondition: the
// segmentation is of this volume. Thread contract: pure; parallel inside, same bytes for any number
// of threads. Source: Schroeder, Maynard, Geveci 2015 (flying edges).
ContouredSurface Isosurface(const Volume& volume, const Segmentation& segmentation,
                            const IsosurfaceOptions& options = {});

}  // namespace scan
