// Photographs whose true cameras are known, made harder: masks with stated errors, a wrong focal
// length, a mesh of another CT threshold, other pictures' sizes.
#pragma once

#include "reconstruction/evaluate/drawn_mask.h"
#include "reconstruction/evaluate/pose_trial.h"

namespace scan {

struct TurntableErrors {
  int w = 0;                   // of the photographs, px; 0: as they are
  double focal_error_rel = 0;  // by which the stated focal length is longer; its sigma grows alike
  double turntable_sigma_rad = 0, lift_sigma_mm = 0;  // stated, of each view; 0: as logged
};

// Changes the size of the photographs in stated and true cameras, and what is stated of focal
// length and logged axes. When the size changes the masks no longer fit: DrawMasks.
void StateErrors(PoseTrial& trial, const TurntableErrors& errors);

// Moves the solvers' mesh, not the true surface, outwards along its normals, as a CT threshold that
// is too low does; inwards where negative.
void OffsetMesh(PoseTrial& trial, double outwards_mm);

// Every photograph's mask drawn anew from `trial.surface` at its true camera. Same bytes for any
// number of threads.
void DrawMasks(PoseTrial& trial, const DrawnMaskOptions& options);

}  // namespace scan
