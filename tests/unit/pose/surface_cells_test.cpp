#include "reconstruction/pose/surface_cells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pose_scene.h"

namespace scan {
namespace {

int CellNear(const SurfaceCells& cells, const Eigen::Vector3d& point) {
  int best = 0;
  for (int c = 1; c < static_cast<int>(cells.centre.size()); ++c)
    if ((cells.centre[c] - point).norm() < (cells.centre[best] - point).norm()) best = c;
  return best;
}

// The bug is made of eight shells: body, head, horn and five legs.
TEST(SurfaceCells, HornAndLegsEndInTips) {
  const TriangleMesh mesh = test::BugMesh(3);
  const ContourMesh contour_mesh(mesh);
  const SurfaceCells cells = CellsOf(contour_mesh, 0.6);
  const std::vector<int> tips = TipsOf(cells, contour_mesh.centre, 2.4);
  const auto shell = static_cast<std::ptrdiff_t>(mesh.vertices.size() / 8);
  for (int part = 2; part < 8; ++part) {
    const auto first = mesh.vertices.begin() + part * shell;
    const Eigen::Vector3d end = *std::max_element(first, first + shell, [&](auto& a, auto& b) {
      return (a - contour_mesh.centre).norm() < (b - contour_mesh.centre).norm();
    });
    EXPECT_TRUE(std::any_of(tips.begin(), tips.end(), [&](int tip) {
      return (cells.centre[tip] - end).norm() < 1.2;
    })) << part;
  }
  EXPECT_LT(tips.size(), 40u);
}

TEST(SurfaceCells, WaysRunAlongTheSurface) {
  TriangleMesh mesh = test::BugMesh(3);
  const TriangleMesh other = mesh;
  const auto size = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const Eigen::Vector3d& v : other.vertices)
    mesh.vertices.emplace_back(v + Eigen::Vector3d(0, 0, 60));
  for (const Face& f : other.faces) mesh.faces.push_back({f[0] + size, f[1] + size, f[2] + size});
  const ContourMesh contour_mesh(mesh);
  const SurfaceCells cells = CellsOf(contour_mesh, 0.6);
  const std::vector<double> way = DistancesFrom(cells, {CellNear(cells, {0, 0, 13})});
  // Over the body from its top to its tail: a quarter of an ellipse of 11 and 5 mm.
  const double quarter_mm = 13.0;
  const double found = way[static_cast<std::size_t>(CellNear(cells, {-11, 0, 8}))];
  EXPECT_GT(found, 0.95 * quarter_mm);
  EXPECT_LT(found, 1.2 * quarter_mm);
  // No way leads to another bug.
  EXPECT_TRUE(std::isinf(way[static_cast<std::size_t>(CellNear(cells, mesh.vertices.back()))]));
}

}  // namespace
}  // namespace scan
