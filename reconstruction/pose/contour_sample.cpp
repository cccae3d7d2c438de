#include "reconstruction/pose/contour_sample.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "reconstruction/pose/covered_spans.h"

namespace scan {
namespace {

constexpr double kProbePx = 1.2;  // beyond an outline, at this distance, lies the background

// The edge's own normal, turned to the smooth normals of its ends where they agree within 60
// degrees: these carry less of the mesh's zigzag.
Eigen::Vector2d Smoothed(const Eigen::Vector2d& edge_normal, const Eigen::Vector3d& normal_sum,
                         const Eigen::Matrix3d& rotation) {
  const Eigen::Vector2d image = (rotation * normal_sum).head<2>();
  const double norm = image.norm();
  if (norm < 0.3 || image.dot(edge_normal) < 0.5 * norm) return edge_normal;
  return image / norm;
}

// Points in the picture, each projected when it is first asked for; NaN where not in front of the
// camera.
class Pixels {
 public:
  Pixels(const std::vector<Eigen::Vector3d>& points, const CameraFromModel& camera_from_model,
         const Intrinsics& intrinsics)
      : points_(points),
        rotation_(camera_from_model.rotation()),
        translation_(camera_from_model.translation()),
        intrinsics_(intrinsics),
        pixels_(points.size(), Eigen::Vector2d::Constant(kNotYet)) {}

  const Eigen::Vector2d& operator[](std::uint32_t point) {
    Eigen::Vector2d& pixel = pixels_[point];
    if (pixel.x() == kNotYet) {
      const Eigen::Vector3d x = rotation_.lazyProduct(points_[point]) + translation_;
      pixel = Project(intrinsics_, x)
                  .value_or(Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()));
    }
    return pixel;
  }

 private:
  static constexpr double kNotYet = std::numeric_limits<double>::max();
  const std::vector<Eigen::Vector3d>& points_;
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d translation_;
  const Intrinsics& intrinsics_;
  std::vector<Eigen::Vector2d> pixels_;
};

// Which way the triangle turns in the picture: 1, -1, 0 when it is seen edge-on or a corner is NaN.
// Computed from its first corner in the mesh, so that it is the same from each of its edges.
int TurnOf(std::array<std::uint32_t, 3> corners, Pixels& pixels) {
  while (corners[0] > corners[1] || corners[0] > corners[2])
    corners = {corners[1], corners[2], corners[0]};
  const Eigen::Vector2d a = pixels[corners[0]];
  const Eigen::Vector2d ab = pixels[corners[1]] - a, ac = pixels[corners[2]] - a;
  const double cross = ab.x() * ac.y() - ab.y() * ac.x();
  return (cross > 0) - (cross < 0);
}

// An edge all of whose faces lie on one side of it in the picture.
struct Fold {
  std::array<std::uint32_t, 2> vertices;
  Eigen::Vector2d a, b;
  Eigen::Vector2d normal;  // away from the faces
};

struct Folds {
  std::vector<Fold> folds;
  CoveredSpans covered;
};

Folds FindFolds(const ContourMesh& mesh, const CameraFromModel& camera_from_model,
                const Intrinsics& intrinsics) {
  Folds found{{}, CoveredSpans(intrinsics.w, intrinsics.h)};
  const ContourClusters& all = mesh.clusters;
  Pixels pixels(all.points, camera_from_model, intrinsics);
  const Eigen::Vector3d camera_centre = CameraCentre(camera_from_model);
  for (const ContourCluster& cluster : all.clusters) {
    if (TurnsOneSide(cluster, camera_from_model, intrinsics, camera_centre)) continue;
    for (const ContourEdge& edge :
         std::span(all.edges).subspan(cluster.first_edge, cluster.edge_count)) {
      const auto [ia, ib] = edge.ends;
      int net = 0;  // faces on one side of the edge less those on the other
      for (std::uint32_t k = 0; k < edge.corner_count; ++k)
        net += TurnOf({ia, ib, all.corners[edge.first_corner + k]}, pixels);
      if (net == 0) continue;
      const Eigen::Vector2d a = pixels[ia], b = pixels[ib];
      found.covered.AddEdge(a, b, net);
      if (std::abs(net) != static_cast<int>(edge.corner_count)) continue;
      const Eigen::Vector2d along = (b - a).normalized();
      // As in MeshEdges the lower index is first.
      found.folds.push_back({{all.mesh_vertices[ia], all.mesh_vertices[ib]},
                             a,
                             b,
                             net > 0 ? Eigen::Vector2d(along.y(), -along.x())
                                     : Eigen::Vector2d(-along.y(), along.x())});
    }
  }
  found.covered.Finish();
  // In the mesh's own order neighbours follow each other, those of short edges that stand for
  // others among them.
  std::sort(found.folds.begin(), found.folds.end(),
            [](const Fold& p, const Fold& q) { return p.vertices < q.vertices; });
  return found;
}

bool IsClosed(const TriangleMesh& mesh, const MeshEdges& edges) {
  for (const MeshEdge& edge : edges.edges) {
    int sum = 0;
    for (std::uint32_t k = 0; k < edge.face_count; ++k)
      sum += RunsForward(mesh.faces[edges.faces[edge.first_face + k]], edge.vertices) ? 1 : -1;
    if (sum != 0) return false;
  }
  return true;
}

}  // namespace

ContourMesh::ContourMesh(const TriangleMesh& triangle_mesh)
    : mesh(triangle_mesh),
      edges(BuildMeshEdges(triangle_mesh)),
      clusters(MakeContourClusters(triangle_mesh, edges)),
      closed(IsClosed(triangle_mesh, edges)),
      vertex_normals(VertexNormals(triangle_mesh)),
      centre(MassCentre(triangle_mesh)) {
  for (const auto& v : mesh.vertices) radius_mm = std::max(radius_mm, (v - centre).norm());
}

// Evidence is only what borders on the background, and the spans of covered pixels are enough to
// tell: ContourGenerators with its depth and id buffers gives the same contours in 7 times the time
// (bench_pose_speed).
std::vector<ContourSample> FindContourSamples(const ContourMesh& contour_mesh,
                                              const CameraFromModel& camera_from_model,
                                              const Intrinsics& intrinsics, double spacing_px) {
  const TriangleMesh& mesh = contour_mesh.mesh;
  const Folds found = FindFolds(contour_mesh, camera_from_model, intrinsics);
  const Eigen::Matrix3d rotation = camera_from_model.rotation();
  std::vector<ContourSample> samples;
  double skipped_px = 0;
  for (const Fold& fold : found.folds) {
    const auto [ia, ib] = fold.vertices;
    const Eigen::Vector2d &a = fold.a, &b = fold.b;
    const auto at_background = [&](const Eigen::Vector2d& p) {
      return p.x() >= 0 && p.y() >= 0 && p.x() < intrinsics.w && p.y() < intrinsics.h &&
             !found.covered.Covered(p + kProbePx * fold.normal);
    };
    const double length = (b - a).norm();
    if (length + skipped_px < 0.5 * spacing_px) {
      if (at_background(0.5 * (a + b))) skipped_px += length;
      continue;
    }
    const Eigen::Vector2d normal = Smoothed(
        fold.normal, contour_mesh.vertex_normals[ia] + contour_mesh.vertex_normals[ib], rotation);
    const int pieces = std::max(1, static_cast<int>(std::lround(length / spacing_px)));
    for (int k = 0; k < pieces; ++k) {
      const double t = (k + 0.5) / pieces;
      if (!at_background((1 - t) * a + t * b)) continue;
      const Eigen::Vector3d point = (1 - t) * mesh.vertices[ia] + t * mesh.vertices[ib];
      const auto pixel = Project(intrinsics, camera_from_model * point);
      if (!pixel) continue;
      samples.push_back({point, *pixel, normal, 0.5 / pieces * (b - a),
                         length / pieces + skipped_px, fold.vertices});
      skipped_px = 0;
    }
  }
  return samples;
}

}  // namespace scan
