#include "reconstruction/mesh/bvh.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <boost/variant.hpp>
#include <cassert>
#include <cmath>
#include <vector>

namespace scan {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using CgalTree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Kernel::Point_3 ToCgal(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }
Eigen::Vector3d FromCgal(const Kernel::Point_3& p) { return {p.x(), p.y(), p.z()}; }

}  // namespace

struct MeshBvh::Tree {
  Triangles triangles;
  std::vector<std::uint32_t> face;  // of each triangle
  CgalTree tree;

  std::uint32_t FaceOf(Triangles::const_iterator at) const {
    return face[static_cast<std::size_t>(at - triangles.begin())];
  }
};

MeshBvh::MeshBvh(const TriangleMesh& mesh) : tree_(std::make_unique<Tree>()) {
  const auto normals = FaceNormals(mesh);
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    if (normals[f].isZero()) continue;
    const Face& face = mesh.faces[f];
    tree_->triangles.emplace_back(ToCgal(mesh.vertices[face[0]]), ToCgal(mesh.vertices[face[1]]),
                                  ToCgal(mesh.vertices[face[2]]));
    tree_->face.push_back(f);
  }
  if (tree_->triangles.empty()) return;
  tree_->tree.rebuild(tree_->triangles.cbegin(), tree_->triangles.cend());
  tree_->tree.build();  // now, so that queries are const indeed
  tree_->tree.accelerate_distance_queries();
}

MeshBvh::~MeshBvh() = default;
MeshBvh::MeshBvh(MeshBvh&&) noexcept = default;
MeshBvh& MeshBvh::operator=(MeshBvh&&) noexcept = default;

std::optional<ClosestPoint> MeshBvh::Closest(const Eigen::Vector3d& point) const {
  if (tree_->triangles.empty()) return std::nullopt;
  const auto [at, primitive] = tree_->tree.closest_point_and_primitive(ToCgal(point));
  const Eigen::Vector3d on_surface = FromCgal(at);
  return ClosestPoint{on_surface, tree_->FaceOf(primitive), (on_surface - point).norm()};
}

std::optional<RayHit> MeshBvh::FirstHit(const Eigen::Vector3d& origin,
                                        const Eigen::Vector3d& direction) const {
  assert(direction.norm() > 0);
  if (tree_->triangles.empty()) return std::nullopt;
  const Kernel::Ray_3 ray(ToCgal(origin), ToCgal(origin + direction));
  const auto hit = tree_->tree.first_intersection(ray);
  if (!hit) return std::nullopt;
  // A ray inside a face's plane meets it in a segment: its nearer end counts.
  double distance = HUGE_VAL;
  if (const auto* at = boost::get<Kernel::Point_3>(&hit->first)) {
    distance = (FromCgal(*at) - origin).norm();
  } else if (const auto* segment = boost::get<Kernel::Segment_3>(&hit->first)) {
    distance = std::min((FromCgal(segment->source()) - origin).norm(),
                        (FromCgal(segment->target()) - origin).norm());
  } else {
    return std::nullopt;
  }
  return RayHit{distance, tree_->FaceOf(hit->second)};
}

}  // namespace scan
