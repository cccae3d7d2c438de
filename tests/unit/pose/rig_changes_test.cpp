#include "reconstruction/pose/rig_changes.h"

#include <gtest/gtest.h>

#include "drivers/base/rng.h"
#include "drivers/base/units.h"
#include "pose_scene.h"

namespace scan {
namespace {

// A body of revolution with the noise of a CT's surface.
TriangleMesh RoughRevolution() {
  TriangleMesh mesh = test::RevolutionMesh(120, Eigen::Vector3d::UnitZ());
  Rng rng(3);
  for (Eigen::Vector3d& v : mesh.vertices)
    v += 0.03 * Eigen::Vector3d(rng.Normal(), rng.Normal(), rng.Normal());
  return mesh;
}

RefineOptions ForMediumPhotos() {
  RefineOptions options;
  options.correlation_floor_px *= 0.5;  // they are half as wide
  return options;
}

// The noise in a round body's outline leads some degrees about its axis, and explains nothing.
TEST(EvidenceOfViewsAlone, ARoundBodyStaysWhereTheRigPutsIt) {
  const TriangleMesh mesh = RoughRevolution();
  const TableFromModel placing(ExpSo3({0.1, -0.15, 0}), Eigen::Vector3d(1, -1, 3));
  const test::Scene scene = test::MakeScene(test::RevolutionMesh(240, Eigen::Vector3d::UnitZ()),
                                            placing, test::MediumPhotos(8));
  std::vector<PhotoContour> photos;
  for (const Mask& mask : scene.masks) photos.push_back(MakePhotoContour(mask));
  RigModel rig(scene.photos, {});
  rig.set_start(0, placing);
  const RefineOptions options = ForMediumPhotos();
  const RigEvidence evidence =
      EvidenceOfViewsAlone(ContourMesh(mesh), rig, photos, std::vector<bool>(photos.size(), true),
                           rig.Nominal(), options.correlation_floor_px, options);
  for (std::size_t i = 0; i < photos.size(); ++i) {
    ASSERT_TRUE(evidence[i]);
    EXPECT_LT(DegFromRad(AngleBetween(evidence[i]->state.camera_from_model.rotation(),
                                      scene.truth[i].rotation())),
              0.01)
        << i;
  }
}

// An outline that is explained by another pose only leads there.
TEST(EvidenceOfViewsAlone, AMovedBodyIsFoundWhereItIs) {
  const TriangleMesh mesh = test::BugMesh(2);
  const TableFromModel placing(ExpSo3({0.1, -0.15, 0}), Eigen::Vector3d(1, -1, 3));
  const test::Scene scene = test::MakeScene(mesh, placing, test::MediumPhotos(4));
  std::vector<PhotoContour> photos;
  for (const Mask& mask : scene.masks) photos.push_back(MakePhotoContour(mask));
  RigModel rig(scene.photos, {});
  Vector6d off;
  off << 0, 0, RadFromDeg(2), 0.3, 0, 0;
  rig.set_start(0, MovedAbout(placing, off, Eigen::Vector3d::Zero()));
  const RefineOptions options = ForMediumPhotos();
  const RigEvidence evidence =
      EvidenceOfViewsAlone(ContourMesh(mesh), rig, photos, std::vector<bool>(photos.size(), true),
                           rig.Nominal(), options.correlation_floor_px, options);
  for (std::size_t i = 0; i < photos.size(); ++i) {
    ASSERT_TRUE(evidence[i]);
    EXPECT_LT(DegFromRad(AngleBetween(evidence[i]->state.camera_from_model.rotation(),
                                      scene.truth[i].rotation())),
              0.1)
        << i;
  }
}

TEST(RigChanges, LostStepsAtAViewWhereTheSpecimenMovedSayNothingMore) {
  using Kind = RigChange::Kind;
  std::vector<RigChange> changes{{Kind::steps_lost, 4},
                                 {Kind::steps_lost, 7},
                                 {Kind::view_alone, 4},
                                 {Kind::specimen_moved, 7}};
  RemoveContained(changes);
  ASSERT_EQ(changes.size(), 3u);
  EXPECT_EQ(changes[0].view, 4);
  EXPECT_EQ(changes[1].kind, Kind::view_alone);
  EXPECT_EQ(changes[2].kind, Kind::specimen_moved);
}

}  // namespace
}  // namespace scan
