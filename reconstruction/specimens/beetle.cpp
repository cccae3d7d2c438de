// A horned beetle, standing: thin jointed legs, forked horn, antennae, spotted wing cases.
#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "drivers/base/units.h"
#include "reconstruction/specimens/catalogue.h"
#include "reconstruction/specimens/colour.h"
#include "reconstruction/specimens/shape.h"
#include "reconstruction/specimens/solid_noise.h"

namespace scan::specimens {
namespace {

using Eigen::Vector3d;

enum Material { kAbdomen, kElytra, kPronotum, kHead, kHorn, kEye, kLeg, kAntenna };

void AddBody(Shape& shape) {
  PartGroup& abdomen = shape.AddGroup(kAbdomen, 0.6, 0);
  Add(abdomen, Ellipsoid{{-4.2, 0, 6.9}, {8.6, 5.3, 3.4}});
  Add(abdomen, Ellipsoid{{4.8, 0, 6.6}, {4.2, 4.2, 2.8}});

  // Two overlapping shells: the suture is the valley between them.
  PartGroup& elytra = shape.AddGroup(kElytra, 0.12, 0.25);
  for (double side : {-1.0, 1.0}) {
    const Eigen::Matrix3d yaw =
        Eigen::AngleAxisd(side * RadFromDeg(3.0), Vector3d::UnitZ()).toRotationMatrix();
    Add(elytra, Ellipsoid{{-4.6, side * 1.75, 8.1}, {9.4, 4.5, 4.6}, yaw});
  }

  PartGroup& pronotum = shape.AddGroup(kPronotum, 0.8, 0.2);
  Add(pronotum, Ellipsoid{{5.2, 0, 8.3}, {4.1, 5.3, 3.9}});
  Add(pronotum, RoundCone{{6.2, 0, 10.4}, {8.6, 0, 13.0}, 1.5, 0.42});

  PartGroup& head = shape.AddGroup(kHead, 0.7, 0.35);
  Add(head, Ellipsoid{{9.7, 0, 7.0}, {2.6, 2.3, 1.8}});
  Add(head, Ellipsoid{{11.6, 0, 6.4}, {1.5, 1.7, 0.8}});

  PartGroup& eyes = shape.AddGroup(kEye, 0, 0.1);
  for (double side : {-1.0, 1.0}) Add(eyes, Ellipsoid{{10.3, side * 2.1, 7.4}, {0.75, 0.6, 0.7}});

  PartGroup& horn = shape.AddGroup(kHorn, 0.35, 0.6);
  AddSwept(horn, {{10.9, 0, 7.8}, {13.2, 0.05, 9.4}, {14.6, 0.15, 12.0}, {14.3, 0.25, 14.6}},
           {1.15, 0.85, 0.62, 0.5}, 4);
  AddSwept(horn, {{14.3, 0.25, 14.6}, {14.0, 1.1, 15.9}, {13.3, 1.9, 16.7}}, {0.5, 0.42, 0.32}, 3);
  AddSwept(horn, {{14.3, 0.25, 14.6}, {14.2, -0.7, 16.0}, {14.0, -1.3, 17.2}}, {0.5, 0.42, 0.32},
           3);
}

struct LegPose {
  Vector3d hip, knee, ankle, toe;
};

void AddLeg(Shape& shape, const LegPose& leg) {
  PartGroup& group = shape.AddGroup(kLeg, 0.15, 0.3);
  const Vector3d thigh = leg.hip + 0.45 * (leg.knee - leg.hip) + Vector3d(0, 0, 0.25);
  AddSwept(group, {leg.hip, thigh, leg.knee}, {0.7, 0.95, 0.55}, 3);
  Add(group, RoundCone{leg.knee, leg.ankle, 0.5, 0.62});
  // Spurs at the end of the shin.
  const Vector3d out = (leg.ankle - leg.knee).normalized();
  const Vector3d side = out.cross(Vector3d::UnitZ()).normalized();
  Add(group, RoundCone{leg.ankle, leg.ankle + 1.0 * out + 0.75 * side, 0.4, 0.3});
  const Vector3d shin = leg.knee + 0.6 * (leg.ankle - leg.knee);
  Add(group, RoundCone{shin, shin + 0.55 * out - 0.95 * side, 0.42, 0.3});
  // Beads of the foot, then two claws.
  const Vector3d step = (leg.toe - leg.ankle) / 4;
  for (int k = 0; k < 4; ++k) {
    Add(group, RoundCone{leg.ankle + k * step, leg.ankle + (k + 0.8) * step, 0.31, 0.4});
  }
  const Vector3d ahead = step.normalized(), across = ahead.cross(Vector3d::UnitZ()).normalized();
  for (double s : {-1.0, 1.0}) {
    Add(group, RoundCone{leg.toe, leg.toe + 0.8 * ahead + s * 0.55 * across, 0.33, 0.3});
  }
}

void AddLegs(Shape& shape) {
  const std::array<LegPose, 6> legs{{
      {{7.2, 2.6, 5.4}, {9.6, 7.4, 7.0}, {12.2, 9.0, 3.2}, {14.6, 9.6, 0.5}},
      {{7.2, -2.6, 5.4}, {8.8, -7.7, 7.4}, {12.6, -8.6, 4.4}, {15.2, -7.6, 2.6}},
      {{1.6, 3.4, 4.8}, {1.8, 9.4, 6.4}, {0.4, 12.2, 2.4}, {1.2, 14.2, 0.5}},
      {{1.6, -3.4, 4.8}, {0.6, -9.6, 6.0}, {-2.2, -11.6, 2.2}, {-2.6, -14.2, 0.6}},
      {{-3.0, 3.2, 4.5}, {-7.4, 8.2, 6.2}, {-11.2, 9.6, 2.2}, {-13.6, 11.0, 0.5}},
      {{-3.0, -3.2, 4.5}, {-6.2, -8.6, 5.4}, {-9.0, -11.4, 1.8}, {-12.0, -12.2, 0.4}},
  }};
  for (const LegPose& leg : legs) AddLeg(shape, leg);
}

void AddAntenna(Shape& shape, const std::array<Vector3d, 3>& elbow, const Vector3d& club) {
  PartGroup& group = shape.AddGroup(kAntenna, 0.15, 0.2);
  AddSwept(group, {elbow[0], elbow[1], elbow[2]}, {0.34, 0.31, 0.31}, 3);
  // Three leaves that spread from the last joint.
  const Vector3d ahead = (club - elbow[2]).normalized();
  const Vector3d across = ahead.cross(Vector3d::UnitZ()).normalized();
  for (double s : {-0.55, 0.0, 0.55}) {
    Add(group, RoundCone{elbow[2], club + s * across, 0.3, 0.38});
  }
}

class Beetle final : public Specimen {
 public:
  Beetle() {
    AddBody(shape_);
    AddLegs(shape_);
    AddAntenna(shape_, {{{11.0, 1.7, 6.8}, {12.4, 3.4, 7.6}, {14.0, 4.0, 8.4}}}, {15.3, 5.0, 8.9});
    AddAntenna(shape_, {{{11.0, -1.7, 6.8}, {12.2, -3.5, 7.0}, {13.6, -4.6, 6.6}}},
               {15.0, -5.3, 6.7});
    shape_.Finish();
  }

  std::string_view name() const override { return "beetle"; }
  double SignedDistance(const Vector3d& p) const override { return shape_.SignedDistance(p); }
  BoundingBox Bounds() const override { return shape_.Bounds(); }

  Vector3d Albedo(const Vector3d& p) const override {
    const double coarse = FractalNoise(p / 5.0, 3, 0.7, 100);
    const double fine = FractalNoise(p / 1.3, 3, 0.75, 200);
    const double light = std::exp(0.30 * coarse + 0.32 * fine);
    return Bounded(Paint(p, coarse, fine) * light);
  }

  double Density(const Vector3d& p) const override {
    const double depth = -shape_.SignedDistance(p);
    if (depth < 0) return 0;
    if (depth < kCuticle_mm) return 0.9;
    // Air sacs above, the gut along the body, tissue around.
    const Vector3d sac = (p - Vector3d(-3.5, 1.2, 9.6)).cwiseQuotient(Vector3d(5.0, 2.2, 1.3));
    const Vector3d sac2 = (p - Vector3d(5.0, -1.0, 9.0)).cwiseQuotient(Vector3d(1.9, 1.7, 1.2));
    if (sac.squaredNorm() < 1 || sac2.squaredNorm() < 1) return 0.02;
    const double gut = std::hypot(p.y() - 0.8 * std::sin(0.5 * p.x()), p.z() - 6.8);
    if (p.x() > -10 && p.x() < 9 && gut < 1.1) return gut < 0.6 ? 0.35 : 0.62;
    return 0.48 + 0.05 * FractalNoise(p / 1.5, 2, 0.6, 300);
  }

 private:
  static constexpr double kCuticle_mm = 0.4;

  Vector3d Paint(const Vector3d& p, double coarse, double fine) const {
    const Vector3d black = FromSrgb8(46, 34, 28), chestnut = FromSrgb8(128, 62, 30);
    const Vector3d mahogany = FromSrgb8(88, 36, 24), amber = FromSrgb8(236, 168, 52);
    switch (shape_.MaterialAt(p)) {
      case kElytra: {
        const double warped_y = p.y() + 0.35 * coarse;
        // Rows of fine furrows along the wing cases, a dark suture and rim.
        const double furrow = 0.5 + 0.5 * std::cos(2 * kPi * std::abs(p.y()) / 1.05);
        Vector3d c = Mix(chestnut, mahogany, 0.75 * SmoothStep(0.55, 1.0, furrow));
        c = Mix(c, black, SmoothStep(0.55, 0.2, std::abs(p.y())));
        c = Mix(c, black, SmoothStep(8.4, 7.2, p.z() + 0.4 * fine));
        const CellPoint cell = NearestCellPoint(Vector3d(p.x(), warped_y, 0.6 * p.z()) / 3.4, 7);
        const double spot = SmoothStep(0.40, 0.32, cell.distance + 0.05 * fine);
        return Mix(c, Mix(amber, FromSrgb8(214, 96, 34), cell.value), spot);
      }
      case kPronotum: {
        const double band = std::abs(std::abs(p.y()) - 2.6 - 0.5 * coarse);
        return Mix(Mix(black, mahogany, 0.5 + 0.5 * coarse), amber,
                   SmoothStep(0.8, 0.4, band) * 0.8);
      }
      case kHead:
        return Mix(black, chestnut, 0.35 + 0.35 * coarse);
      case kHorn:
        return Mix(mahogany, black, SmoothStep(9, 15, p.z() + coarse));
      case kEye:
        return Mix(FromSrgb8(120, 96, 40), FromSrgb8(40, 52, 24), 0.5 + 0.5 * fine);
      case kLeg: {
        // Paler rings along the legs.
        const double ring = 0.5 + 0.5 * std::sin(2.2 * std::hypot(p.x(), p.y()) + 1.5 * coarse);
        return Mix(mahogany, FromSrgb8(186, 108, 50), SmoothStep(0.6, 0.95, ring));
      }
      case kAntenna:
        return Mix(FromSrgb8(202, 118, 44), mahogany, 0.5 + 0.5 * coarse);
      default: {
        const double ring = 0.5 + 0.5 * std::sin(2 * kPi * p.x() / 2.1 + coarse);
        return Mix(mahogany, FromSrgb8(168, 104, 58), 0.7 * SmoothStep(0.3, 0.9, ring));
      }
    }
  }

  Shape shape_;
};

}  // namespace

std::unique_ptr<Specimen> MakeBeetle() { return std::make_unique<Beetle>(); }

}  // namespace scan::specimens
