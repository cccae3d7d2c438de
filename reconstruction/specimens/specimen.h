// Synthetic specimens with known truth: shape, interior and colour from implicit functions.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/base/result.h"
#include "reconstruction/mesh/mesh.h"

namespace scan {

// Model frame, mm; the specimen stands along +z (its lowest point near z = bounds.low.z), about
// 30 mm large. Thread contract: const calls from any thread.
class Specimen {
 public:
  virtual ~Specimen() = default;
  virtual std::string_view name() const = 0;
  // Negative inside, positive outside; its slope is at most 1, so that its size is a lower bound of
  // the distance to the surface; equal to that near the surface except in fillets.
  virtual double SignedDistance(const Eigen::Vector3d& p) const = 0;
  // Linear-light RGB albedo in [0, 1] of a surface point; varies everywhere.
  virtual Eigen::Vector3d Albedo(const Eigen::Vector3d& p) const = 0;
  // Material density in [0, 1] (0 air, 1 densest): the interior that CT shows.
  virtual double Density(const Eigen::Vector3d& p) const = 0;
  virtual BoundingBox Bounds() const = 0;
};

// beetle, orchid, mushroom, tomato (an exact body of revolution), tomato-flushed (the same, its
// colour following the density under its skin), tomato-stalk (bent stalk).
std::vector<std::string> SpecimenNames();
// Of these names, or of one followed by "+beads" (see beaded.h). Errors: bad_input for an unknown
// name.
Result<std::unique_ptr<Specimen>> MakeSpecimen(std::string_view name);

// The exact surface as a fine mesh: vertices lie on SignedDistance = 0 to 1e-4 mm, edges about
// `edge_mm` long, closed, manifold and outward. Same bytes for any number of threads.
// Precondition: edge_mm > 0.
TriangleMesh ExactSurface(const Specimen& specimen, double edge_mm);

}  // namespace scan
