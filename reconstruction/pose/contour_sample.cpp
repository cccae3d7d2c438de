#include "reconstruction/pose/contour_sample.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reconstruction/pose/silhouette_raster.h"

namespace scan {
namespace {

constexpr double kProbePx = 1.2;  // beyond an outline, at this distance, lies the background

std::uint32_t CornerOpposite(const Face& face, const std::array<std::uint32_t, 2>& edge) {
  for (const std::uint32_t v : face)
    if (v != edge[0] && v != edge[1]) return v;
  return face[0];
}

bool Covered(const cv::Mat& mask, const Eigen::Vector2d& p) {
  const int x = static_cast<int>(std::floor(p.x())), y = static_cast<int>(std::floor(p.y()));
  return x >= 0 && y >= 0 && x < mask.cols && y < mask.rows && mask.at<uchar>(y, x) != 0;
}

// The edge's own normal, turned to the smooth normals of its ends where they agree within 60
// degrees: these carry less of the mesh's zigzag.
Eigen::Vector2d Smoothed(const Eigen::Vector2d& edge_normal, const Eigen::Vector3d& normal_sum,
                         const Eigen::Matrix3d& rotation) {
  const Eigen::Vector2d image = (rotation * normal_sum).head<2>();
  const double norm = image.norm();
  if (norm < 0.3 || image.dot(edge_normal) < 0.5 * norm) return edge_normal;
  return image / norm;
}

struct ProjectedMesh {
  std::vector<Eigen::Vector2d> pixels;  // NaN where not in front of the camera
  // Which way each face turns in the picture: 1, -1, 0 when it is seen edge-on. Empty unless the
  // mesh is closed and all of it in front of the camera.
  std::vector<std::int8_t> turns;
  cv::Mat mask;
};

int SignOf(double v) { return (v > 0) - (v < 0); }

std::vector<std::int8_t> TurnsOf(const std::vector<Face>& faces,
                                 const std::vector<Eigen::Vector2d>& pixels) {
  std::vector<std::int8_t> turns;
  turns.reserve(faces.size());
  for (const Face& face : faces) {
    const Eigen::Vector2d &a = pixels[face[0]], ab = pixels[face[1]] - a, ac = pixels[face[2]] - a;
    turns.push_back(static_cast<std::int8_t>(SignOf(ab.x() * ac.y() - ab.y() * ac.x())));
  }
  return turns;
}

ProjectedMesh ProjectMesh(const ContourMesh& contour_mesh, const CameraFromModel& camera_from_model,
                          const Intrinsics& intrinsics) {
  const TriangleMesh& mesh = contour_mesh.mesh;
  const Eigen::Vector2d nowhere =
      Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  ProjectedMesh projected;
  projected.pixels.reserve(mesh.vertices.size());
  std::vector<Eigen::Vector2f> rounded;
  rounded.reserve(mesh.vertices.size());
  const Eigen::Matrix3d rotation = camera_from_model.rotation();
  const Eigen::Vector3d translation = camera_from_model.translation();
  bool all_in_front = true;
  for (const Eigen::Vector3d& v : mesh.vertices) {
    const auto pixel = Project(intrinsics, rotation * v + translation);
    all_in_front &= pixel.has_value();
    projected.pixels.push_back(pixel.value_or(nowhere));
    rounded.push_back(projected.pixels.back().cast<float>());
  }
  projected.mask = cv::Mat(intrinsics.h, intrinsics.w, CV_8U, cv::Scalar(0));
  const bool solid = all_in_front && contour_mesh.closed;
  if (solid) projected.turns = TurnsOf(mesh.faces, projected.pixels);
  FillTriangles(rounded, mesh.faces, projected.mask, {.one_side = solid});
  return projected;
}

// The outward normal of the projected edge where all of its faces project to one side of it;
// zero where they do not (NaN corners included).
Eigen::Vector2d FoldNormal(const ContourMesh& mesh, const MeshEdge& edge,
                           const std::vector<Eigen::Vector2d>& pixels) {
  const Eigen::Vector2d& a = pixels[edge.vertices[0]];
  const Eigen::Vector2d along = pixels[edge.vertices[1]] - a;
  Eigen::Vector2d normal(-along.y(), along.x());
  double first_side = 0;
  for (std::uint32_t k = 0; k < edge.face_count; ++k) {
    const Face& face = mesh.mesh.faces[mesh.edges.faces[edge.first_face + k]];
    const double side = normal.dot(pixels[CornerOpposite(face, edge.vertices)] - a);
    if (k == 0) first_side = side;
    if (!(side * first_side > 0)) return Eigen::Vector2d::Zero();
  }
  const double length = normal.norm();
  if (!(length > 1e-9)) return Eigen::Vector2d::Zero();
  normal /= length;
  return first_side > 0 ? Eigen::Vector2d(-normal) : normal;
}

// Two faces that run through their edge in opposite directions and turn alike in the picture lie
// on either side of it. A quick way past most edges.
bool LiesFlat(const ContourMesh& mesh, const MeshEdge& edge,
              const std::vector<std::int8_t>& turns) {
  if (turns.empty() || edge.face_count != 2) return false;
  const std::uint32_t* faces = &mesh.edges.faces[edge.first_face];
  return turns[faces[0]] * turns[faces[1]] > 0;
}

int RunsThrough(const Face& face, const std::array<std::uint32_t, 2>& edge) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (face[k] == edge[0] && face[(k + 1) % 3] == edge[1]) return 1;
  }
  return -1;
}

bool IsClosed(const TriangleMesh& mesh, const MeshEdges& edges) {
  for (const MeshEdge& edge : edges.edges) {
    int sum = 0;
    for (std::uint32_t k = 0; k < edge.face_count; ++k)
      sum += RunsThrough(mesh.faces[edges.faces[edge.first_face + k]], edge.vertices);
    if (sum != 0) return false;
  }
  return true;
}

}  // namespace

ContourMesh::ContourMesh(const TriangleMesh& triangle_mesh)
    : mesh(triangle_mesh),
      edges(BuildMeshEdges(triangle_mesh)),
      closed(IsClosed(triangle_mesh, edges)),
      vertex_normals(VertexNormals(triangle_mesh)),
      centre(MassCentre(triangle_mesh)) {
  for (const auto& v : mesh.vertices) radius_mm = std::max(radius_mm, (v - centre).norm());
}

// Evidence is only what borders on the background, and a picture of the covered pixels is enough to
// tell: ContourGenerators with its depth and id buffers gives the same contours in 3 to 5 times the
// time (40 k faces, 1848 x 1224).
std::vector<ContourSample> FindContourSamples(const ContourMesh& contour_mesh,
                                              const CameraFromModel& camera_from_model,
                                              const Intrinsics& intrinsics, double spacing_px) {
  const TriangleMesh& mesh = contour_mesh.mesh;
  const ProjectedMesh projected = ProjectMesh(contour_mesh, camera_from_model, intrinsics);
  const Eigen::Matrix3d rotation = camera_from_model.rotation();
  std::vector<ContourSample> samples;
  double skipped_px = 0;
  for (const MeshEdge& edge : contour_mesh.edges.edges) {
    if (LiesFlat(contour_mesh, edge, projected.turns)) continue;
    const Eigen::Vector2d edge_normal = FoldNormal(contour_mesh, edge, projected.pixels);
    if (edge_normal.isZero()) continue;
    const auto [ia, ib] = edge.vertices;
    const Eigen::Vector2d &a = projected.pixels[ia], &b = projected.pixels[ib];
    const auto at_background = [&](const Eigen::Vector2d& p) {
      return p.x() >= 0 && p.y() >= 0 && p.x() < intrinsics.w && p.y() < intrinsics.h &&
             !Covered(projected.mask, p + kProbePx * edge_normal);
    };
    const double length = (b - a).norm();
    if (length + skipped_px < 0.5 * spacing_px) {
      if (at_background(0.5 * (a + b))) skipped_px += length;
      continue;
    }
    const Eigen::Vector2d normal = Smoothed(
        edge_normal, contour_mesh.vertex_normals[ia] + contour_mesh.vertex_normals[ib], rotation);
    const int pieces = std::max(1, static_cast<int>(std::lround(length / spacing_px)));
    for (int k = 0; k < pieces; ++k) {
      const double t = (k + 0.5) / pieces;
      if (!at_background((1 - t) * a + t * b)) continue;
      const Eigen::Vector3d point = (1 - t) * mesh.vertices[ia] + t * mesh.vertices[ib];
      const auto pixel = Project(intrinsics, camera_from_model * point);
      if (!pixel) continue;
      samples.push_back({point, *pixel, normal, 0.5 / pieces * (b - a),
                         length / pieces + skipped_px, edge.vertices});
      skipped_px = 0;
    }
  }
  return samples;
}

}  // namespace scan
