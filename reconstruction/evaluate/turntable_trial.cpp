#include "reconstruction/evaluate/turntable_trial.h"

#include <tbb/parallel_for.h>

#include <cmath>

namespace scan {
namespace {

Intrinsics OfWidth(const Intrinsics& in, int w) {
  return Scaled(in, w, static_cast<int>(std::lround(static_cast<double>(w) * in.h / in.w)));
}

}  // namespace

void StateErrors(PoseTrial& trial, const TurntableErrors& errors) {
  for (LensState& lens : trial.photos.lens_states) {
    if (errors.w > 0) {
      lens.sigma.c_px *= static_cast<double>(errors.w) / lens.intrinsics.w;
      lens.intrinsics = OfWidth(lens.intrinsics, errors.w);
    }
    lens.intrinsics.fl_x *= 1 + errors.focal_error_rel;
    lens.intrinsics.fl_y *= 1 + errors.focal_error_rel;
    lens.sigma.fl_rel = std::hypot(lens.sigma.fl_rel, errors.focal_error_rel);
  }
  if (errors.w > 0)
    for (PoseOf& truth : trial.truth) truth.intrinsics = OfWidth(truth.intrinsics, errors.w);
  for (Photo& photo : trial.photos.photos) {
    if (photo.turntable_rad && errors.turntable_sigma_rad > 0)
      photo.turntable_rad->sigma_view = errors.turntable_sigma_rad;
    if (photo.lift_mm && errors.lift_sigma_mm > 0) photo.lift_mm->sigma_view = errors.lift_sigma_mm;
  }
}

void OffsetMesh(PoseTrial& trial, double outwards_mm) {
  const std::vector<Eigen::Vector3d> normals = VertexNormals(trial.mesh);
  for (std::size_t i = 0; i < normals.size(); ++i)
    trial.mesh.vertices[i] += outwards_mm * normals[i];
}

void DrawMasks(PoseTrial& trial, const DrawnMaskOptions& options) {
  trial.masks.assign(trial.truth.size(), {});
  tbb::parallel_for(std::size_t{0}, trial.masks.size(), [&](std::size_t i) {
    trial.masks[i] = DrawMask(trial.surface, trial.truth[i], options, i);
  });
}

}  // namespace scan
