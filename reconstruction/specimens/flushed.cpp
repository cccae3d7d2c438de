// The exact tomato, ripened unevenly: flesh under the skin is denser where it is riper, and the
// skin is coloured by it.
#include <algorithm>
#include <cmath>

#include "reconstruction/specimens/catalogue.h"
#include "reconstruction/specimens/colour.h"
#include "reconstruction/specimens/solid_noise.h"

namespace scan::specimens {
namespace {

using Eigen::Vector3d;

class FlushedTomato final : public Specimen {
 public:
  FlushedTomato() : tomato_(MakeTomato(false)) {}

  std::string_view name() const override { return "tomato-flushed"; }
  double SignedDistance(const Vector3d& p) const override { return tomato_->SignedDistance(p); }
  BoundingBox Bounds() const override { return tomato_->Bounds(); }

  // Over the tomato's own pattern, which has nothing to do with what lies under it.
  Vector3d Albedo(const Vector3d& p) const override {
    const Vector3d yellow = FromSrgb8(214, 172, 62);
    const double speckle = 1 + 0.25 * FractalNoise(p / 0.8, 2, 0.5, 541);
    return Bounded(speckle * Mix(yellow, tomato_->Albedo(p), 0.35 + 0.65 * Ripeness(p)));
  }

  double Density(const Vector3d& p) const override {
    const double density = tomato_->Density(p);
    const double depth = -tomato_->SignedDistance(p);
    if (depth < kSkin_mm || depth > kFlesh_mm) return density;
    return std::clamp(density + 0.22 * (Ripeness(p) - 0.5), 0.0, 1.0);
  }

 private:
  static constexpr double kSkin_mm = 0.5, kFlesh_mm = 4.5;

  // Blotches some 5 mm across, more of them on one side than on the other.
  static double Ripeness(const Vector3d& p) {
    const double side = 0.03 * p.x() - 0.015 * p.y();
    return SmoothStep(-0.35, 0.35, FractalNoise(p / 9.0, 2, 0.5, 540) + side);
  }

  std::unique_ptr<Specimen> tomato_;
};

}  // namespace

std::unique_ptr<Specimen> MakeFlushedTomato() { return std::make_unique<FlushedTomato>(); }

}  // namespace scan::specimens
