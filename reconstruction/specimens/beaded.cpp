#include "reconstruction/specimens/beaded.h"

#include <algorithm>
#include <cmath>

#include "reconstruction/specimens/colour.h"

namespace scan {
namespace {

using Eigen::Vector3d;

class Beaded final : public Specimen {
 public:
  Beaded(std::unique_ptr<Specimen> specimen, const BeadedOptions& options)
      : specimen_(std::move(specimen)),
        name_(std::string(specimen_->name()) + "+beads"),
        beads_(BeadPlaces(*specimen_, options)),
        colour_(specimens::FromSrgb8(static_cast<int>(options.srgb[0]),
                                     static_cast<int>(options.srgb[1]),
                                     static_cast<int>(options.srgb[2]))),
        density_(options.specimen_density) {}

  std::string_view name() const override { return name_; }
  double SignedDistance(const Vector3d& p) const override {
    return std::min(specimen_->SignedDistance(p), ToBeads(p));
  }
  Vector3d Albedo(const Vector3d& p) const override {
    constexpr double kSkin_mm = 0.02;  // drawn surfaces are polygons
    return ToBeads(p) < kSkin_mm ? colour_ : specimen_->Albedo(p);
  }
  double Density(const Vector3d& p) const override {
    return ToBeads(p) <= 0 ? 1.0 : density_ * specimen_->Density(p);
  }
  BoundingBox Bounds() const override {
    BoundingBox box = specimen_->Bounds();
    for (const Bead& bead : beads_) {
      box.low = box.low.cwiseMin(Vector3d(bead.centre.array() - bead.radius_mm));
      box.high = box.high.cwiseMax(Vector3d(bead.centre.array() + bead.radius_mm));
    }
    return box;
  }

 private:
  double ToBeads(const Vector3d& p) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Bead& bead : beads_)
      nearest = std::min(nearest, (p - bead.centre).norm() - bead.radius_mm);
    return nearest;
  }

  std::unique_ptr<Specimen> specimen_;
  std::string name_;
  std::vector<Bead> beads_;
  Vector3d colour_;
  double density_;
};

}  // namespace

std::vector<Bead> BeadPlaces(const Specimen& specimen, const BeadedOptions& options) {
  const BoundingBox box = specimen.Bounds();
  const Vector3d half = 0.5 * (box.high - box.low);
  const double reach = half.norm();
  const auto outward = [&](const Vector3d& p) {
    constexpr double h = 1e-4;
    Vector3d slope;
    for (int a = 0; a < 3; ++a)
      slope[a] = specimen.SignedDistance(p + h * Vector3d::Unit(a)) -
                 specimen.SignedDistance(p - h * Vector3d::Unit(a));
    return slope.normalized();
  };
  std::vector<Bead> beads;
  for (const auto& [longitude, height] : options.places) {
    const Vector3d from_axis = box.centre() + Vector3d(0, 0, height * half.z());
    const Vector3d out(std::cos(longitude), std::sin(longitude), 0);
    // From outside inwards; what misses a slender specimen ends at its nearest point instead.
    Vector3d p = from_axis + reach * out;
    for (int i = 0; i < 500 && specimen.SignedDistance(p) > 1e-7 && (p - from_axis).dot(out) > 0;
         ++i)
      p -= specimen.SignedDistance(p) * out;
    for (int i = 0; i < 50; ++i) p -= specimen.SignedDistance(p) * outward(p);
    const double radius = 0.5 * options.diameter_mm;
    beads.push_back({p + options.proud * radius * outward(p), radius, 0, 0});
  }
  return beads;
}

std::unique_ptr<Specimen> WithBeads(std::unique_ptr<Specimen> specimen,
                                    const BeadedOptions& options) {
  return std::make_unique<Beaded>(std::move(specimen), options);
}

}  // namespace scan
