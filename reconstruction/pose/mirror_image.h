// Whether photographs without logged poses show the mesh or its mirror image: slices in reversed
// order and flipped axes make one of the other, and from one side each looks much like the other.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "reconstruction/pose/contour_evidence.h"
#include "reconstruction/pose/contour_sample.h"
#include "reconstruction/pose/joint_refine.h"

namespace scan {

struct PosedView {
  const PhotoContour* photo = nullptr;
  ViewState state;  // found with the mesh as it is
};

// All outlines with the mesh as it is against its mirror image, each at its best pose near by.
struct MirrorComparison {
  double gap = 0;        // by which the log-likelihood with the mesh as it is is larger
  double misfit = 0;     // minus the log-likelihood of the nearer of the two
  double scale_gap = 0;  // observations times log of the residuals' scale, mirror image over mesh
};

// For the mirror image the search starts from where a distant camera would see the same outline. px
// of `refine`: of the photographs. Thread contract: pure; parallel inside.
MirrorComparison CompareWithMirrorImage(const ContourMesh& mesh, std::span<const PosedView> views,
                                        const RefineOptions& refine);

// Why every view without a logged pose is rejected; empty unless the mirror image is decidedly
// nearer.
std::string MirrorReason(const MirrorComparison& comparison);
// What the report says where the outlines cannot tell; else empty.
std::string MirrorNote(const MirrorComparison& comparison);
bool IsMirrorNote(const std::string& note);

}  // namespace scan
