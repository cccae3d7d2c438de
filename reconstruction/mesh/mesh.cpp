#include "reconstruction/mesh/mesh.h"

#include <Eigen/Geometry>
#include <cassert>
#include <cmath>

namespace scan {
namespace {

// Twice the area times the unit normal.
Eigen::Vector3d DoubleAreaVector(const TriangleMesh& mesh, const Face& face) {
  const Eigen::Vector3d& a = mesh.vertices[face[0]];
  return (mesh.vertices[face[1]] - a).cross(mesh.vertices[face[2]] - a);
}

Eigen::Vector3d UnitOrZero(const Eigen::Vector3d& v) {
  const double length = v.stableNorm();
  return length > 0 && std::isfinite(length) ? Eigen::Vector3d(v / length)
                                             : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

struct WeightedCentre {
  double weight = 0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
};

WeightedCentre SurfaceMoment(const TriangleMesh& mesh, const Eigen::Vector3d& origin) {
  WeightedCentre sum;
  for (const Face& face : mesh.faces) {
    const double area = 0.5 * DoubleAreaVector(mesh, face).stableNorm();
    const Eigen::Vector3d centre =
        (mesh.vertices[face[0]] + mesh.vertices[face[1]] + mesh.vertices[face[2]]) / 3 - origin;
    sum.weight += area;
    sum.moment += area * centre;
  }
  return sum;
}

// Signed tetrahedra between `origin` and the faces.
WeightedCentre SolidMoment(const TriangleMesh& mesh, const Eigen::Vector3d& origin) {
  WeightedCentre sum;
  for (const Face& face : mesh.faces) {
    const Eigen::Vector3d a = mesh.vertices[face[0]] - origin;
    const Eigen::Vector3d b = mesh.vertices[face[1]] - origin;
    const Eigen::Vector3d c = mesh.vertices[face[2]] - origin;
    const double volume = a.dot(b.cross(c)) / 6;
    sum.weight += volume;
    sum.moment += volume * (a + b + c) / 4;
  }
  return sum;
}

// At most one edge in a hundred open or turned the wrong way: the volume integral still means
// something.
bool NearlyClosed(const TriangleMesh& mesh) {
  const TopologyReport topology = CheckTopology(mesh);
  const std::size_t edges = mesh.faces.size() * 3 / 2;
  return 100 * (topology.boundary_edges + topology.inconsistent_edges) <= edges;
}

}  // namespace

std::vector<Eigen::Vector3d> VertexNormals(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> normals(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (const Face& face : mesh.faces) {
    const Eigen::Vector3d n = DoubleAreaVector(mesh, face);
    for (const std::uint32_t v : face) normals[v] += n;
  }
  for (Eigen::Vector3d& n : normals) n = UnitOrZero(n);
  return normals;
}

std::vector<Eigen::Vector3d> FaceNormals(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> normals;
  normals.reserve(mesh.faces.size());
  for (const Face& face : mesh.faces) normals.push_back(UnitOrZero(DoubleAreaVector(mesh, face)));
  return normals;
}

double SurfaceArea(const TriangleMesh& mesh) {
  double area = 0;
  for (const Face& face : mesh.faces) area += 0.5 * DoubleAreaVector(mesh, face).stableNorm();
  return area;
}

double SignedVolume(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return 0;
  // About the middle of the mesh: far from the origin the terms would cancel badly.
  return SolidMoment(mesh, BoundsOf(mesh).centre()).weight;
}

Eigen::Vector3d MassCentre(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return Eigen::Vector3d::Zero();
  const BoundingBox bounds = BoundsOf(mesh);
  const Eigen::Vector3d origin = bounds.centre();
  const double smallest_volume = 1e-9 * std::pow(bounds.diagonal(), 3);
  const WeightedCentre solid = SolidMoment(mesh, origin);
  if (std::abs(solid.weight) > smallest_volume && NearlyClosed(mesh)) {
    const Eigen::Vector3d centre = solid.moment / solid.weight;
    // Shells that cancel each other can push it outside, where no mass centre can be.
    const Eigen::Vector3d half = 0.5 * (bounds.high - bounds.low);
    if ((centre.array().abs() <= half.array()).all()) return origin + centre;
  }
  const WeightedCentre surface = SurfaceMoment(mesh, origin);
  if (surface.weight > 0) return origin + surface.moment / surface.weight;
  return origin;
}

BoundingBox BoundsOf(const TriangleMesh& mesh) {
  assert(!mesh.vertices.empty());
  BoundingBox box{mesh.vertices.front(), mesh.vertices.front()};
  for (const Eigen::Vector3d& v : mesh.vertices) {
    box.low = box.low.cwiseMin(v);
    box.high = box.high.cwiseMax(v);
  }
  return box;
}

}  // namespace scan
