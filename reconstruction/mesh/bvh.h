// Closest-point and ray queries against a mesh.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>

#include "reconstruction/mesh/mesh.h"

namespace scan {

struct ClosestPoint {
  Eigen::Vector3d point;  // on the surface, mm
  std::uint32_t face = 0;
  double distance_mm = 0;
};

struct RayHit {
  double distance_mm = 0;  // along the unit direction
  std::uint32_t face = 0;
};

// Faces without an area are left out. Thread contract: const calls from any thread.
class MeshBvh {
 public:
  explicit MeshBvh(const TriangleMesh& mesh);
  ~MeshBvh();
  MeshBvh(MeshBvh&&) noexcept;
  MeshBvh& operator=(MeshBvh&&) noexcept;

  // Nothing only when the mesh has no face with an area.
  std::optional<ClosestPoint> Closest(const Eigen::Vector3d& point) const;

  // The first face in the half line from `origin`; both sides count.
  // Precondition: `direction` is not zero.
  std::optional<RayHit> FirstHit(const Eigen::Vector3d& origin,
                                 const Eigen::Vector3d& direction) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace scan
