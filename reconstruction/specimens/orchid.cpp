// An orchid on its stem: curved petals that hide each other, a lip, a column within.
#include <Eigen/Geometry>
#include <cmath>

#include "drivers/base/units.h"
#include "reconstruction/specimens/catalogue.h"
#include "reconstruction/specimens/colour.h"
#include "reconstruction/specimens/shape.h"
#include "reconstruction/specimens/solid_noise.h"

namespace scan::specimens {
namespace {

using Eigen::Vector3d;

enum Material { kStem, kSepal, kPetal, kLip, kColumn };

const Vector3d kHeart(1.0, 0, 19.5);  // where the petals meet; the flower looks along +x

struct Sheet {
  Vector3d base, along;  // where it starts and where to
  Vector3d face;         // the direction it looks in
  double length_mm, half_width_mm;
  double curl_mm, droop_mm;  // the tip bends along `face`; the middle bulges against it
  double twist_rad;
};

// A bent row of flat, overlapping ellipsoids: 0.72 mm thick.
void AddSheet(Shape& shape, int material, const Sheet& sheet) {
  PartGroup& group = shape.AddGroup(material, 0.22, 0.15);
  constexpr int kPieces = 13;
  const Vector3d along = sheet.along.normalized();
  const Vector3d face = (sheet.face - sheet.face.dot(along) * along).normalized();
  const auto centre = [&](double t) -> Vector3d {
    return sheet.base + along * sheet.length_mm * t +
           face * (sheet.curl_mm * t * t - sheet.droop_mm * std::sin(kPi * t));
  };
  for (int k = 0; k < kPieces; ++k) {
    const double t = 0.06 + 0.88 * k / (kPieces - 1);
    const Vector3d tangent = (centre(t + 0.01) - centre(t - 0.01)).normalized();
    const double turn = sheet.twist_rad * (t - 0.3);
    const Vector3d across = Eigen::AngleAxisd(turn, tangent) * tangent.cross(face).normalized();
    Eigen::Matrix3d axes;
    axes << tangent, across, tangent.cross(across);
    const double width =
        0.5 + sheet.half_width_mm * std::pow(std::sin(kPi * (0.08 + 0.84 * t)), 0.8);
    Add(group, Ellipsoid{centre(t), {0.13 * sheet.length_mm, width, 0.36}, axes});
  }
}

void AddFlower(Shape& shape) {
  const auto radial = [](double degrees, double forward) {
    const double a = RadFromDeg(degrees);
    return Vector3d(forward, std::cos(a), std::sin(a));
  };
  const Vector3d x = Vector3d::UnitX();
  // Three sepals behind, two broad petals before them.
  AddSheet(shape, kSepal, {kHeart, radial(91, -0.1), x, 11.2, 3.0, 1.6, 0.7, 0.2});
  AddSheet(shape, kSepal, {kHeart, radial(-38, -0.15), x, 11.0, 2.7, 2.4, 0.5, 0.5});
  AddSheet(shape, kSepal, {kHeart, radial(-145, -0.2), x, 10.6, 2.7, 1.0, 0.9, -0.4});
  const Vector3d front = kHeart + Vector3d(0.8, 0, 0.2);
  AddSheet(shape, kPetal, {front, radial(22, 0.12), x, 11.6, 4.4, 2.6, 1.0, 0.3});
  AddSheet(shape, kPetal, {front, radial(160, 0.05), x, 11.8, 4.4, 1.4, 1.2, -0.5});
  // The lip: a tongue that curls forward between two upright lobes.
  const Vector3d throat = kHeart + Vector3d(1.2, 0, -0.6);
  AddSheet(shape, kLip, {throat, {0.85, 0.05, -0.75}, {0.6, 0, 0.8}, 8.6, 2.6, -2.4, 0.9, 0.2});
  AddSheet(shape, kLip, {throat, {0.9, 0.75, 0.35}, {-0.2, -1, 0.3}, 4.8, 1.5, 1.2, 0.3, 0.3});
  AddSheet(shape, kLip, {throat, {0.9, -0.7, 0.25}, {-0.2, 1, 0.3}, 4.6, 1.5, 1.0, 0.3, -0.2});
  PartGroup& column = shape.AddGroup(kColumn, 0.5, 0.3);
  AddSwept(column, {kHeart, kHeart + Vector3d(2.4, 0.05, 0.5), kHeart + Vector3d(4.2, 0.1, 0.2)},
           {1.2, 0.95, 0.75}, 4);
  Add(column, Ellipsoid{kHeart + Vector3d(4.4, 0.1, 0.2), {1.0, 1.05, 0.85}});
}

class Orchid final : public Specimen {
 public:
  Orchid() {
    PartGroup& stem = shape_.AddGroup(kStem, 0.3, 0);
    AddSwept(stem, {{-1.2, 1.2, 0.9}, {-2.0, 0.6, 7}, {-2.4, 0.1, 13}, {-1.4, 0, 17.6}, kHeart},
             {0.95, 0.8, 0.75, 0.85, 1.25}, 6);
    PartGroup& bud = shape_.AddGroup(kStem, 0.3, 0.4);
    AddSwept(bud, {{-2.1, 0.5, 8}, {-3.6, 1.6, 10.2}, {-4.6, 2.4, 12.4}}, {0.6, 0.5, 0.55}, 4);
    Add(bud, Ellipsoid{{-5.0, 2.7, 13.4}, {1.25, 1.25, 1.9}});
    AddFlower(shape_);
    AddSheet(shape_, kStem,
             {{-1.5, 1.0, 2.6}, {-0.3, -0.8, 0.75}, {0.9, -0.5, -0.2}, 9.0, 1.5, -1.8, 0.6, 0.4});
    shape_.Finish();
  }

  std::string_view name() const override { return "orchid"; }
  double SignedDistance(const Vector3d& p) const override { return shape_.SignedDistance(p); }
  BoundingBox Bounds() const override { return shape_.Bounds(); }

  Vector3d Albedo(const Vector3d& p) const override {
    const double coarse = FractalNoise(p / 5.0, 3, 0.7, 700);
    const double fine = FractalNoise(p / 1.3, 3, 0.8, 710);
    return Bounded(Paint(p, coarse, fine) * std::exp(0.14 * coarse + 0.22 * fine));
  }

  double Density(const Vector3d& p) const override {
    const double depth = -shape_.SignedDistance(p);
    if (depth < 0) return 0;
    if (depth < 0.45) return 0.8;
    return 0.55 + 0.05 * FractalNoise(p / 1.2, 2, 0.6, 720);
  }

 private:
  Vector3d Paint(const Vector3d& p, double coarse, double fine) const {
    const Vector3d q = p - kHeart;
    const double out = std::hypot(q.y(), q.z()), angle = std::atan2(q.z(), q.y());
    const Vector3d magenta = FromSrgb8(190, 48, 128), rose = FromSrgb8(228, 132, 172);
    const Vector3d white = FromSrgb8(244, 226, 222), purple = FromSrgb8(118, 20, 84);
    const Vector3d yellow = FromSrgb8(240, 190, 60), green = FromSrgb8(96, 134, 52);
    const double veins = std::abs(std::sin(19 * angle + 1.1 * coarse));
    switch (shape_.MaterialAt(p)) {
      case kSepal: {
        const Vector3d c = Mix(rose, magenta, SmoothStep(3, 11, out + 1.5 * coarse));
        return Mix(c, FromSrgb8(170, 168, 84), 0.45 * SmoothStep(0.35, 0.05, veins));
      }
      case kPetal: {
        Vector3d c = Mix(white, magenta, SmoothStep(2.5, 11.5, out + 1.6 * coarse));
        c = Mix(c, purple, 0.6 * SmoothStep(0.3, 0.05, veins));
        const CellPoint spot = NearestCellPoint(p / 1.8, 730);
        return Mix(c, purple, SmoothStep(0.3, 0.22, spot.distance) * SmoothStep(9, 4, out));
      }
      case kLip: {
        const Vector3d c = Mix(yellow, purple, SmoothStep(2.2, 5.2, q.x() - 0.4 * q.z() + coarse));
        const CellPoint spot = NearestCellPoint(p / 1.2, 740);
        return Mix(c, FromSrgb8(150, 26, 40), 0.8 * SmoothStep(0.36, 0.28, spot.distance));
      }
      case kColumn:
        return Mix(Mix(white, yellow, SmoothStep(2.8, 4.6, q.x())), rose, 0.4 + 0.4 * fine);
      default:
        return Mix(Mix(green, FromSrgb8(58, 88, 38), 0.5 + 0.5 * coarse), FromSrgb8(134, 70, 74),
                   0.6 * SmoothStep(0.2, 0.7, fine));
    }
  }

  Shape shape_;
};

}  // namespace

std::unique_ptr<Specimen> MakeOrchid() { return std::make_unique<Orchid>(); }

}  // namespace scan::specimens
