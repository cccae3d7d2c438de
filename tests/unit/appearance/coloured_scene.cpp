#include "coloured_scene.h"

#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "reconstruction/specimens/photograph.h"
#include "reconstruction/specimens/synthetic_ct.h"
#include "reconstruction/surface/surface.h"

namespace scan::test {

ColouredScene MakeColouredScene(std::shared_ptr<const Specimen> specimen,
                                const SceneOptions& options, double voxel_mm) {
  ColouredScene made;
  made.folder = std::make_unique<TempFolder>();
  made.scene =
      MakeScene(ExactSurface(*specimen, 0.3),
                TableFromModel(ExpSo3({0.1, -0.15, 1.3}), Eigen::Vector3d(1.5, -2, 1)), options);
  made.mesh = ExactSurface(*specimen, 0.4);
  if (voxel_mm > 0) {
    CtOptions ct;
    ct.voxel_mm = voxel_mm;
    ct.supersampling = 2;
    made.volume = SynthesiseCt(*specimen, ct);
    SurfaceOptions surface_options;
    surface_options.decimate.faces = 60'000;
    auto surface = ExtractSurface(made.volume, surface_options);
    if (surface) made.mesh = std::move(surface->mesh);
  }
  PhotographOptions looks;
  looks.edge_mm = 0.3;
  const PhotographScene photographed = MakePhotographScene(std::move(specimen), looks);
  for (std::size_t i = 0; i < made.scene.photos.photos.size(); ++i) {
    Photo& photo = made.scene.photos.photos[i];
    photo.path = made.folder->path() / (photo.name + ".png");
    cv::imwrite(photo.path.string(),
                RenderPhotograph(photographed, made.scene.truth[i], made.scene.true_intrinsics[i]));
  }
  return made;
}

Poses PosesTurnedBy(const ColouredScene& scene, double common_rad,
                    const std::vector<double>& own_rad) {
  Poses poses;
  const auto turn = [](double angle) {
    return Transform<frame::Model, frame::Model>(ExpSo3(angle * Eigen::Vector3d::UnitZ()),
                                                 Eigen::Vector3d::Zero());
  };
  poses.mountings.push_back({"m0", scene.scene.table_from_model * turn(-common_rad)});
  FreeDirection free;
  free.of = "m0";
  poses.free_directions.push_back(free);
  for (std::size_t i = 0; i < scene.scene.truth.size(); ++i) {
    const Photo& photo = scene.scene.photos.photos[i];
    ViewPose view;
    view.name = photo.name;
    view.mounting = "m0";
    view.lens_state = std::to_string(i);
    view.status = ViewStatus::accepted;
    view.camera_from_model =
        scene.scene.truth[i] * turn(-common_rad - (own_rad.empty() ? 0 : own_rad[i]));
    view.covariance = Matrix6d::Identity();
    poses.lens_states[view.lens_state].intrinsics = scene.scene.true_intrinsics[i];
    poses.views.push_back(view);
  }
  return poses;
}

std::vector<double> AzimuthErrors(const ColouredScene& scene, const Poses& poses) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < poses.views.size(); ++i) {
    const Eigen::Quaterniond q(Eigen::Matrix3d(scene.scene.truth[i].rotation().transpose() *
                                               poses.views[i].camera_from_model.rotation()));
    errors.push_back(std::remainder(2 * std::atan2(q.z(), q.w()), 2 * EIGEN_PI));
  }
  return errors;
}

}  // namespace scan::test
