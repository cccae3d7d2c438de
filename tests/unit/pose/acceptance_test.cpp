#include "reconstruction/pose/acceptance.h"

#include <gtest/gtest.h>

#include "pose_scene.h"

namespace scan {
namespace {

constexpr double kTolerancePx = 0.5;

// A plate with four rods across it, 1.6 mm from one to the next.
TriangleMesh PlateWithRods(double rod_radius_mm) {
  TriangleMesh mesh;
  const auto add_box = [&](const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
    for (int corner = 0; corner < 8; ++corner)
      mesh.vertices.emplace_back(corner & 1 ? high.x() : low.x(), corner & 2 ? high.y() : low.y(),
                                 corner & 4 ? high.z() : low.z());
    for (const Face& f :
         {Face{0, 2, 1}, Face{1, 2, 3}, Face{4, 5, 6}, Face{5, 7, 6}, Face{0, 1, 4}, Face{1, 5, 4},
          Face{2, 6, 3}, Face{3, 6, 7}, Face{0, 4, 2}, Face{2, 4, 6}, Face{1, 3, 5}, Face{3, 7, 5}})
      mesh.faces.push_back({f[0] + base, f[1] + base, f[2] + base});
  };
  add_box({-6, -4, -2}, {6, 4, 2});
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector3d half(rod_radius_mm, 9, rod_radius_mm), middle(1.6 * k - 2.4, 0, 0);
    add_box(middle - half, middle + half);
  }
  return mesh;
}

// 3 px per mm.
ViewState FromTheFront() {
  return {CameraFromModel(ExpSo3({0, 0, 0.2}), Eigen::Vector3d(0.1, 0.03, 550)),
          {231, 153, 1650, 1650, 115.5, 76.5, 0, 0, 0, 0, 0},
          0};
}

Explained AtTheTruth(const TriangleMesh& mesh, const TriangleMesh& photographed) {
  const ViewState state = FromTheFront();
  const Mask mask = test::RenderMask(photographed, state.camera_from_model, state.intrinsics);
  return ExplainedShares(ContourMesh(mesh), MakePhotoContour(mask), state, kTolerancePx, 1);
}

TEST(ExplainedShares, PartsThinnerThanAPixelAreNotMissed) {
  const TriangleMesh mesh = PlateWithRods(0.08);  // half a pixel
  const Explained explained = AtTheTruth(mesh, mesh);
  EXPECT_GT(explained.photo_share, 0.95);
  EXPECT_GT(explained.model_share, 0.95);
}

TEST(ExplainedShares, PartsThatAPhotographWouldShowAreMissed) {
  const TriangleMesh mesh = PlateWithRods(0.3);  // 1.8 px
  EXPECT_GT(AtTheTruth(mesh, mesh).model_share, 0.95);
  TriangleMesh plate = mesh;
  plate.faces.resize(12);
  EXPECT_LT(AtTheTruth(mesh, plate).model_share, 0.5);
}

}  // namespace
}  // namespace scan
