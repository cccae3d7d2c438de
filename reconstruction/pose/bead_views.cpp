#include "reconstruction/pose/bead_views.h"

#include <algorithm>
#include <cmath>

#include "drivers/base/units.h"
#include "reconstruction/pose/bead_evidence.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan {
namespace {

// A surface this much outside of a ball is the ball's, in radii: isosurfaces draw dense balls a
// little large.
constexpr double kSkin = 0.2;

// Distance to the ball along a unit direction.
std::optional<double> ToBall(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                             const Bead& bead) {
  const Eigen::Vector3d to = bead.centre - origin;
  const double along = to.dot(direction);
  const double inside = bead.radius_mm * bead.radius_mm - (to.squaredNorm() - along * along);
  if (inside < 0 || along <= 0) return {};
  return along - std::sqrt(inside);
}

}  // namespace

double BeadAppearance::area_px() const { return share * kPi * radius_px * radius_px; }

std::optional<BeadAppearance> BeadScene::Appearance(std::size_t index, const ViewState& state,
                                                    int samples) const {
  const Bead& bead = beads_[index];
  const Intrinsics& in = state.intrinsics;
  const double z = (state.camera_from_model * bead.centre).z();
  if (z <= 2 * bead.radius_mm) return {};
  BeadAppearance seen;
  seen.whole = BeadPixel(state, bead.centre, bead.radius_mm);
  seen.radius_px = in.fl_x * bead.radius_mm / std::sqrt(z * z - bead.radius_mm * bead.radius_mm);
  const double r = seen.radius_px;
  if (seen.whole.x() < r || seen.whole.y() < r || seen.whole.x() > in.w - r ||
      seen.whole.y() > in.h - r)
    return {};
  const CameraFromModel& pose = state.camera_from_model;
  const Eigen::Matrix3d model_from_camera = pose.rotation().transpose();
  const Eigen::Vector3d eye = -model_from_camera * pose.translation();
  double of = 0, count = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int j = 0; j < samples; ++j)
    for (int i = 0; i < samples; ++i) {
      const Eigen::Vector2d offset =
          r * Eigen::Vector2d((2 * i + 1.0) / samples - 1, (2 * j + 1.0) / samples - 1);
      const Eigen::Vector3d direction =
          (model_from_camera * RayOfPixel(in, seen.whole + offset)).normalized();
      const auto ball = ToBall(eye, direction, bead);
      if (!ball) continue;
      of += 1;
      const auto hit = bvh_.FirstHit(eye, direction);
      const bool hidden =
          hit && hit->distance_mm < *ball &&
          (eye + hit->distance_mm * direction - bead.centre).norm() > (1 + kSkin) * bead.radius_mm;
      if (hidden) continue;
      count += 1;
      sum += offset;
    }
  if (of == 0) return {};
  seen.share = count / of;
  seen.centroid = seen.whole + sum / std::max(count, 1.0);
  return seen;
}

BeadMatches MatchBeads(const BeadScene& scene, std::span<const BeadImage> images,
                       const ViewState& state, const std::vector<bool>& left_out,
                       const BeadMatchOptions& options) {
  struct Pair {
    double distance;
    std::size_t bead, image;
  };
  BeadMatches matches;
  std::vector<std::optional<BeadAppearance>> seen(scene.beads().size());
  std::vector<Pair> pairs;
  std::vector<bool> known(images.size());  // perhaps of a bead of which too little is seen
  for (std::size_t b = 0; b < seen.size(); ++b) {
    if (left_out[b]) continue;
    seen[b] = scene.Appearance(b, state, options.samples);
    if (!seen[b] || seen[b]->share <= 0) continue;
    const bool used = seen[b]->share >= options.least_share;
    if (seen[b]->share >= options.clear_share) matches.expected.push_back(static_cast<int>(b));
    const double reach = std::max(options.least_reach_px, options.reach_radii * seen[b]->radius_px);
    for (std::size_t i = 0; i < images.size(); ++i) {
      const double ratio = images[i].area_px / seen[b]->area_px();
      const double distance = (images[i].centre - seen[b]->centroid).norm();
      known[i] = known[i] || distance <= reach;
      if (!used || images[i].cut || distance > reach || ratio > options.area_factor ||
          ratio < 1 / options.area_factor)
        continue;
      pairs.push_back({distance, b, i});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& a, const Pair& b) { return a.distance < b.distance; });
  std::vector<bool> bead_taken(seen.size()), image_taken(images.size());
  for (const Pair& pair : pairs) {
    if (bead_taken[pair.bead] || image_taken[pair.image]) continue;
    bead_taken[pair.bead] = image_taken[pair.image] = true;
    const BeadAppearance& as = *seen[pair.bead];
    const Bead& bead = scene.beads()[pair.bead];
    BeadSighting sighting{static_cast<int>(pair.bead), bead.centre, bead.radius_mm,
                          images[pair.image].centre - (as.centroid - as.whole), options.sigma_px};
    // Where the specimen's edge runs across a bead is known less well than the bead's own edge.
    sighting.sigma_px = std::hypot(sighting.sigma_px, 0.15 * (1 - as.share) * as.radius_px);
    matches.sightings.push_back(sighting);
  }
  for (std::size_t i = 0; i < images.size(); ++i) matches.strangers += !known[i] && !images[i].cut;
  return matches;
}

}  // namespace scan
