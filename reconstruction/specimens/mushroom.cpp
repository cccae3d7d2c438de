// A mushroom: nearly a body of revolution, slightly bent, its cap in three shallow lobes.
#include <algorithm>
#include <cmath>

#include "drivers/base/units.h"
#include "reconstruction/specimens/catalogue.h"
#include "reconstruction/specimens/colour.h"
#include "reconstruction/specimens/profile.h"
#include "reconstruction/specimens/solid_noise.h"

namespace scan::specimens {
namespace {

using Eigen::Vector3d;

class Mushroom final : public Specimen {
 public:
  Mushroom()
      : body_({{0, 0},
               {2.4, 0.1},
               {3.7, 1.2},
               {3.5, 3},
               {2.6, 6.5},
               {2.3, 11},
               {2.5, 15},
               {3.6, 16.9},
               {7, 16.8},
               {11, 15.4},
               {13, 14.9},
               {13.9, 15.8},
               {13.4, 18.4},
               {10.8, 22.6},
               {6.4, 25.6},
               {2.4, 26.8},
               {0, 27}},
              20) {}

  std::string_view name() const override { return "mushroom"; }

  double SignedDistance(const Vector3d& p) const override {
    const Vector3d q = Straightened(p);
    // rho^3 cos(3 phi), bounded outside of the cap.
    const double rho = std::hypot(q.x(), q.y());
    const double r = std::min(rho, kLobeRadius_mm) / kLobeRadius_mm;
    const double lobe = kLobe_mm * r * r * r * std::cos(3 * std::atan2(q.y(), q.x()) + 0.4);
    return (body_.SignedDistance(q) - lobe) / kSlope;
  }

  BoundingBox Bounds() const override {
    const double r = body_.max_radius() + kLobe_mm + 0.9;
    return {{-r, -r, body_.low_z() - kLobe_mm}, {r, r, body_.high_z() + kLobe_mm}};
  }

  Vector3d Albedo(const Vector3d& p) const override {
    const double coarse = FractalNoise(p / 5.5, 3, 0.7, 600);
    const double fine = FractalNoise(p / 1.3, 3, 0.8, 610);
    return Bounded(Paint(p, coarse, fine) * std::exp(0.18 * coarse + 0.24 * fine));
  }

  double Density(const Vector3d& p) const override {
    const double depth = -SignedDistance(p);
    if (depth < 0) return 0;
    if (depth < 0.5) return 0.85;
    const Vector3d q = Straightened(p);
    const double rho = std::hypot(q.x(), q.y());
    if (rho < 1.0 && q.z() > 3 && q.z() < 15) return 0.03;  // hollow stem
    // Gills: dense sheets in the lower part of the cap.
    if (rho > 4 && q.z() < 18.5 && q.z() > 15) {
      return std::cos(48 * std::atan2(q.y(), q.x())) > 0 ? 0.8 : 0.5;
    }
    return 0.58 + 0.05 * FractalNoise(p / 1.5, 2, 0.6, 620);
  }

 private:
  static constexpr double kLobe_mm = 0.22, kLobeRadius_mm = 14;
  // Bend and lobes steepen the distance by at most 3.5 % and 5 %.
  static constexpr double kSlope = 1.09;

  static Vector3d Straightened(const Vector3d& p) {
    const double z = std::clamp(p.z(), 0.0, 28.0);
    return {p.x() - 0.8 * (z / 28) * (z / 28), p.y() + 0.3 * (z / 28) * (z / 28), p.z()};
  }

  Vector3d Paint(const Vector3d& p, double coarse, double fine) const {
    const Vector3d q = Straightened(p);
    const double rho = std::hypot(q.x(), q.y()), angle = std::atan2(q.y(), q.x());
    const Vector3d cream = FromSrgb8(226, 204, 164), brown = FromSrgb8(146, 92, 52);
    const Vector3d dark = FromSrgb8(92, 54, 34);
    const bool under = rho > 2.9 && q.z() < 17.1 &&
                       q.z() < 14.2 + 0.12 * (rho - 3) + 2.6 * SmoothStep(13.2, 9, rho);
    if (q.z() < 15.2 && rho < 4.2) {  // stem: fibres, stained foot
      const double fibre =
          SolidNoise({3.4 * std::cos(angle), 3.4 * std::sin(angle), 0.1 * q.z()}, 630);
      return Mix(Mix(cream, brown, 0.35 + 0.45 * fibre), dark,
                 0.7 * SmoothStep(4.5, 0.5, q.z() + 1.5 * coarse));
    }
    if (under) {
      const double gill = 0.5 + 0.5 * std::cos(60 * angle + 0.8 * coarse);
      return Mix(FromSrgb8(206, 158, 120), FromSrgb8(120, 76, 58), gill * 0.8);
    }
    Vector3d c = Mix(brown, dark, SmoothStep(20, 27, q.z() + 2 * coarse));
    c = Mix(c, FromSrgb8(188, 128, 70), 0.7 * SmoothStep(0.1, 0.7, fine));
    // Pale scales, smaller and fewer towards the rim.
    const CellPoint scale = NearestCellPoint(q / 2.9, 640);
    const double size = 0.24 + 0.16 * scale.value;
    return Mix(c, cream, 0.9 * SmoothStep(size + 0.05, size - 0.03, scale.distance + 0.06 * fine));
  }

  Profile body_;
};

}  // namespace

std::unique_ptr<Specimen> MakeMushroom() { return std::make_unique<Mushroom>(); }

}  // namespace scan::specimens
