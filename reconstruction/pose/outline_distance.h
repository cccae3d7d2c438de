// How far the outlines of a set of photographs are from the model's.
#pragma once

#include <span>
#include <vector>

#include "reconstruction/pose/contour_evidence.h"
#include "reconstruction/pose/contour_sample.h"
#include "reconstruction/pose/rig_model.h"

namespace scan {

// Mean distance, in a picture 1848 px wide, of outlines that are of this specimen.
constexpr double kExplainedPx = 3;

// Mean of TwoWayDistance over the photographs of which `use` is true; 0 without any.
// `clip_px`, `spacing_px`: as there. Parallel over the photographs; the same bytes for any number
// of threads.
double MeanOutlineDistance(const ContourMesh& mesh, const RigModel& rig,
                           const RigParameters& parameters, std::span<const PhotoContour> photos,
                           const std::vector<bool>& use, double clip_px, double spacing_px);

}  // namespace scan
