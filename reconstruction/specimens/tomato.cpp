// A small tomato: an exact body of revolution, or one whose stalk bends off the axis.
#include <Eigen/Geometry>
#include <cmath>

#include "drivers/base/units.h"
#include "reconstruction/specimens/catalogue.h"
#include "reconstruction/specimens/colour.h"
#include "reconstruction/specimens/profile.h"
#include "reconstruction/specimens/shape.h"
#include "reconstruction/specimens/solid_noise.h"

namespace scan::specimens {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<Vector2d> Outline(bool bent_stalk) {
  std::vector<Vector2d> outline{{0, 0.9},     {2, 0.6},   {5, 0.35},   {9.2, 1.6}, {13, 5.2},
                                {14.6, 10.4}, {13.3, 16}, {9.6, 19.7}, {6, 20.9},  {3.4, 20.4}};
  if (bent_stalk) {
    outline.insert(outline.end(), {{1.6, 19.7}, {0, 19.5}});
  } else {
    outline.insert(outline.end(),
                   {{1.7, 20.0}, {1.15, 21.0}, {1.0, 23.2}, {1.2, 24.6}, {0.7, 25.1}, {0, 25.2}});
  }
  return outline;
}

class Tomato final : public Specimen {
 public:
  explicit Tomato(bool bent_stalk) : bent_stalk_(bent_stalk), body_(Outline(bent_stalk), 24) {
    if (!bent_stalk) return;
    PartGroup& stalk = stalk_.AddGroup(0, 0.2, 0);
    AddSwept(stalk,
             {{0, 0, 18.6}, {0.2, 0.1, 21.6}, {1.6, 0.4, 24.4}, {4.4, 0.8, 26.2}, {7.6, 1.0, 26.9}},
             {1.3, 1.0, 0.85, 0.8, 0.95}, 5);
    stalk_.Finish();
  }

  std::string_view name() const override { return bent_stalk_ ? "tomato-stalk" : "tomato"; }

  double SignedDistance(const Vector3d& p) const override {
    const double body = body_.SignedDistance(p);
    return bent_stalk_ ? SmoothMin(body, stalk_.SignedDistance(p), kJoin_mm) : body;
  }

  BoundingBox Bounds() const override {
    const double r = body_.max_radius();
    const double top = bent_stalk_ ? stalk_.Bounds().high.z() : body_.high_z();
    return {{-r, -r, body_.low_z()}, {r, r, top}};
  }

  Vector3d Albedo(const Vector3d& p) const override {
    const double coarse = FractalNoise(p / 6.0, 3, 0.7, 500);
    const double fine = FractalNoise(p / 1.4, 3, 0.8, 510);
    const double light = std::exp(0.16 * coarse + 0.26 * fine);
    return Bounded(Paint(p, coarse, fine) * light);
  }

  double Density(const Vector3d& p) const override {
    const double depth = -SignedDistance(p);
    if (depth < 0) return 0;
    if (depth < 0.5 || p.z() > 19.5) return 0.85;
    // Five seed chambers around the core.
    const double rho = std::hypot(p.x(), p.y()), angle = std::atan2(p.y(), p.x());
    const double wall = std::abs(std::sin(2.5 * angle)) * rho;
    if (depth > 2.6 && rho > 3.2 && wall > 1.3 && p.z() > 4 && p.z() < 17) {
      const CellPoint seed = NearestCellPoint(p / 2.6, 530);
      return seed.distance < 0.28 ? 0.8 : 0.42;
    }
    return 0.6;
  }

 private:
  static constexpr double kJoin_mm = 0.8;

  Vector3d Paint(const Vector3d& p, double coarse, double fine) const {
    const Vector3d red = FromSrgb8(200, 42, 28), deep = FromSrgb8(150, 22, 26);
    const Vector3d orange = FromSrgb8(232, 122, 38), green = FromSrgb8(92, 128, 44);
    const double rho = std::hypot(p.x(), p.y()), angle = std::atan2(p.y(), p.x());
    Vector3d c = Mix(red, deep, SmoothStep(-0.1, 0.8, coarse));
    // Pale streaks from the stalk down, ripening shoulder, corky dots.
    const double streak =
        SolidNoise({4.5 * std::cos(angle), 4.5 * std::sin(angle), 0.06 * p.z()}, 520);
    c = Mix(c, orange, 0.65 * SmoothStep(0.05, 0.6, streak) * SmoothStep(2, 12, p.z()));
    c = Mix(c, FromSrgb8(196, 150, 50), 0.7 * SmoothStep(15.5, 20.5, p.z() + 1.2 * coarse));
    const CellPoint dot = NearestCellPoint(p / 1.9, 521);
    c = Mix(c, FromSrgb8(244, 196, 110), 0.85 * SmoothStep(0.24, 0.16, dot.distance + 0.03 * fine));
    // Calyx: five pointed leaves of unequal length, flat on the fruit, painted.
    const double leaf = std::abs(std::remainder(angle - 0.4 - 0.25 * std::sin(angle), 2 * kPi / 5));
    const double reach = 8.2 + 1.4 * std::sin(2 * angle + 1) + 0.5 * coarse;
    const double width = 2.3 * (1 - rho / reach) + 0.25 * fine;
    const bool above = p.z() > 15;
    if (above && (rho * std::sin(std::min(leaf, kPi / 2)) < width || rho < 2.2)) {
      const double vein = SmoothStep(0.35, 0.1, rho * leaf);
      c = Mix(Mix(green, FromSrgb8(54, 86, 34), 0.5 + 0.5 * coarse), FromSrgb8(150, 172, 84),
              0.6 * vein);
    }
    if (p.z() > 21.2) {
      c = Mix(FromSrgb8(110, 132, 58), FromSrgb8(128, 98, 58), 0.5 + 0.5 * fine);
    }
    return c;
  }

  bool bent_stalk_;
  Profile body_;
  Shape stalk_;
};

}  // namespace

std::unique_ptr<Specimen> MakeTomato(bool bent_stalk) {
  return std::make_unique<Tomato>(bent_stalk);
}

}  // namespace scan::specimens
