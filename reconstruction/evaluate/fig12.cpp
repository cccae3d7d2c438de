#include "reconstruction/evaluate/fig12.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <cmath>

#include "drivers/base/rng.h"
#include "drivers/base/units.h"
#include "reconstruction/pose/paper/paper_camera.h"

namespace scan {
namespace {

PaperCamera RandomCamera(Rng& rng, double r0_mm) {
  PaperCamera camera;
  camera.r = rng.Uniform(r0_mm - 10, r0_mm + 10);
  camera.theta = rng.Uniform(0, 2 * kPi);
  camera.phi = rng.Uniform(-0.35 * kPi, 0.35 * kPi);
  camera.delta_x = rng.Uniform(0, 2 * kPi);
  camera.delta_y = rng.Uniform(-0.006 * kPi, 0.006 * kPi);
  camera.delta_z = rng.Uniform(-0.006 * kPi, 0.006 * kPi);
  return camera;
}

Intrinsics CameraOf(const Fig12Options& options) {
  Intrinsics in;
  in.w = options.w;
  in.h = options.h;
  in.fl_x = in.fl_y = options.focal_mm / options.sensor_mm * options.w;
  in.cx = 0.5 * options.w;
  in.cy = 0.5 * options.h;
  return in;
}

}  // namespace

PoseTrial MakeFig12Trial(const TriangleMesh& mesh, const Fig12Options& options) {
  PoseTrial trial;
  trial.mesh = trial.surface = mesh;
  const Intrinsics in = CameraOf(options);
  LensState lens;
  lens.id = "lens";
  lens.intrinsics = in;
  lens.sigma = {1e-6, 1e-3};  // given by the protocol
  trial.photos.lens_states.push_back(lens);
  Aim aim;
  aim.id = "a0";
  aim.camera = "c0";
  trial.photos.aims.push_back(aim);
  trial.photos.approx_distance_mm = options.r0_mm;
  const Eigen::Vector3d mass_centre = MassCentre(mesh);
  Rng rng(options.seed);
  for (int i = 0; i < options.cameras; ++i) {
    Photo photo;
    photo.id = photo.name = fmt::format("v{:03}", i);
    trial.photos.photos.push_back(photo);
    trial.truth.push_back({CameraFromModelOf(RandomCamera(rng, options.r0_mm), mass_centre), in});
  }
  trial.masks.resize(trial.truth.size());
  tbb::parallel_for(std::size_t{0}, trial.masks.size(), [&](std::size_t i) {
    trial.masks[i] =
        DrawMask(mesh, trial.truth[i], {options.noise, options.samples, options.seed}, i);
  });
  return trial;
}

Result<Poses> SolveEachAlone(const PoseTrial& trial, const JointOptions& options,
                             const ProgressFn& progress, std::stop_token stop) {
  const ContourMesh contour_mesh(trial.mesh);
  JointOptions shared = options;
  shared.view_search = std::make_shared<ViewSearch>(
      contour_mesh, trial.photos.approx_distance_mm.value_or(0), options.start, options.view_start);
  const std::size_t count = trial.photos.photos.size();
  std::vector<Result<Poses>> alone(count, tl::unexpected<Error>(Error{}));
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    PhotoSet one = trial.photos;
    one.photos = {trial.photos.photos[i]};
    alone[i] = SolveJoint(trial.mesh, one, {&trial.masks[i], 1}, shared, {}, stop);
  });
  Report(progress, "poses: each alone", 1.0);
  Poses poses;
  for (Result<Poses>& result : alone) {
    if (!result) return tl::unexpected<Error>(result.error());
    if (poses.views.empty()) {
      poses.method = result->method;
      poses.lens_states = result->lens_states;
    }
    poses.views.push_back(result->views.front());
    poses.free_directions.insert(poses.free_directions.end(), result->free_directions.begin(),
                                 result->free_directions.end());
  }
  return poses;
}

}  // namespace scan
