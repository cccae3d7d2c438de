#include "reconstruction/pose/rig_model.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <string>

#include "reconstruction/pose/lens_distortion.h"
#include "reconstruction/pose/nominal_pose.h"
#include "reconstruction/pose/rig_chain.h"

namespace scan {
namespace {

template <class T>
int IndexOf(std::vector<T>& known, const T& id) {
  const auto found = std::find(known.begin(), known.end(), id);
  if (found != known.end()) return static_cast<int>(found - known.begin());
  known.push_back(id);
  return static_cast<int>(known.size()) - 1;
}

// The axis's own error, no less than the floor.
double AtLeast(double sigma, double floor) { return std::hypot(sigma, floor); }

}  // namespace

RigModel::RigModel(const PhotoSet& photos, const RigPriors& priors) : priors_(priors) {
  for (const LensState& lens : photos.lens_states) {
    intrinsics_.push_back(lens.intrinsics);
    held_.emplace_back().fill(true);
    lens_sigma_.push_back(lens.sigma);
    if (lens_sigma_.back().c_px <= 0) lens_sigma_.back().c_px = 0.003 * lens.intrinsics.w;
  }
  for (const Aim& aim : photos.aims) aim_sigma_.push_back(aim.sigma);
  for (const Photo& photo : photos.photos) {
    RigView view;
    const auto nominal = scan::NominalCameraFromTable(photos, photo);
    view.mounting = IndexOf(mounting_ids_, nominal ? photo.mounting_id : ' ' + photo.id);
    view.epoch = IndexOf(epoch_names_, std::to_string(photo.reference_epoch));
    view.aim = photo.aim;
    view.lens = photos.aims[photo.aim].lens_state;
    view.lift_direction = photos.lift_direction_in_station.normalized();
    epoch_sigma_rad_.resize(epoch_names_.size(), 0);
    if (nominal) {
      view.logged = true;
      view.turns = photo.turntable_rad.has_value();
      if (view.turns) {
        view.turntable_rad = photo.turntable_rad->nominal;
        view.sigma_turntable_rad = photo.turntable_rad->sigma_view;
        epoch_sigma_rad_[view.epoch] =
            std::max(epoch_sigma_rad_[view.epoch], photo.turntable_rad->sigma_shared);
      }
      if (photo.lift_mm) view.sigma_lift_mm = photo.lift_mm->sigma_view;
      view.camera_from_station = *nominal * MakeStationFromTable(view.turntable_rad).inverse();
      view.sigma_camera = {
          AtLeast(photo.sigma_view.rotation_rad, priors.view_floor.rotation_rad),
          AtLeast(photo.sigma_view.translation_mm, priors.view_floor.translation_mm)};
    }
    views_.push_back(view);
  }
  start_.resize(mounting_ids_.size());
  std::vector<std::size_t> order(views_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return photos.photos[a].capture_seq < photos.photos[b].capture_seq;
  });
  for (std::size_t rank = 0; rank < order.size(); ++rank)
    views_[order[rank]].taken = static_cast<int>(rank);
}

void RigModel::set_view_start(int view, const CameraFromModel& camera_from_model,
                              const Eigen::Vector3d& mass_centre) {
  RigView& v = views_[static_cast<std::size_t>(view)];
  v.placed = true;
  v.camera_from_station =
      CameraFromStation(Eigen::Matrix3d::Identity(), camera_from_model * mass_centre);
  start_[v.mounting] =
      TableFromModel(camera_from_model.rotation(),
                     camera_from_model.translation() - v.camera_from_station.translation());
}

void RigModel::SplitEpoch(int first_view, const std::string& name, double sigma_rad,
                          RigParameters& parameters) {
  const int before = views_[static_cast<std::size_t>(first_view)].epoch;
  const int after = static_cast<int>(epoch_names_.size());
  epoch_names_.push_back(name);
  epoch_sigma_rad_.push_back(sigma_rad);
  parameters.epochs.push_back(parameters.epochs[static_cast<std::size_t>(before)]);
  const int since = views_[static_cast<std::size_t>(first_view)].taken;
  for (RigView& view : views_)
    if (view.epoch == before && view.taken >= since) view.epoch = after;
}

void RigModel::JoinEpoch(int epoch, int into, RigParameters& parameters) {
  assert(into < epoch);  // it was split from that one
  for (RigView& view : views_) {
    if (view.epoch == epoch) view.epoch = into;
    if (view.epoch > epoch) --view.epoch;
  }
  // What was split off from it since is now split off from the other.
  const std::string gone = epoch_names_[static_cast<std::size_t>(epoch)];
  for (std::string& name : epoch_names_)
    if (name.starts_with(gone + "-"))
      name = epoch_names_[static_cast<std::size_t>(into)] + name.substr(gone.size());
  epoch_names_.erase(epoch_names_.begin() + epoch);
  epoch_sigma_rad_.erase(epoch_sigma_rad_.begin() + epoch);
  parameters.epochs.erase(parameters.epochs.begin() + epoch);
}

void RigModel::SplitMounting(int first_view, const std::string& id, RigParameters& parameters) {
  const int before = views_[static_cast<std::size_t>(first_view)].mounting;
  const int after = static_cast<int>(mounting_ids_.size());
  mounting_ids_.push_back(id);
  start_.push_back(TableFromModel(start_[static_cast<std::size_t>(before)]));
  const std::array<double, 6> placing = parameters.mountings[static_cast<std::size_t>(before)];
  parameters.mountings.push_back(placing);
  const int since = views_[static_cast<std::size_t>(first_view)].taken;
  for (RigView& view : views_)
    if (view.mounting == before && view.taken >= since) view.mounting = after;
}

void RigModel::ReverseTurntable() {
  for (RigView& view : views_) view.turntable_rad = -view.turntable_rad;
}

RigParameters RigModel::Nominal() const {
  RigParameters p;
  p.mountings.resize(mounting_ids_.size(), {});
  p.epochs.resize(epoch_names_.size(), 0);
  p.aims.resize(aim_sigma_.size(), {});
  p.lenses.resize(intrinsics_.size(), {});
  p.views.resize(views_.size(), {});
  return p;
}

CameraFromTable RigModel::NominalCameraFromTable(int view) const {
  return views_[view].camera_from_station * MakeStationFromTable(views_[view].turntable_rad);
}

CameraFromTable RigModel::CameraFromTableOf(const RigParameters& p, int view) const {
  const RigView& v = views_[view];
  const RigidOf<double> table{Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
  const RigidOf<double> x = CameraChain<double>(v, table, p.epochs[v.epoch], p.aims[v.aim].data(),
                                                p.axis.data(), p.views[view].data());
  return CameraFromTable(x.rotation, x.translation);
}

CameraFromModel RigModel::CameraFromModelOf(const RigParameters& p, int view) const {
  const RigView& v = views_[view];
  const RigidOf<double> x = CameraFromModelChain<double>(
      v, start_[v.mounting], p.mountings[v.mounting].data(), p.epochs[v.epoch],
      p.aims[v.aim].data(), p.axis.data(), p.views[view].data(), p.log_ct_scale);
  return CameraFromModel(x.rotation, x.translation);
}

TableFromModel RigModel::TableFromModelOf(const RigParameters& p, int mounting) const {
  const RigidOf<double> x =
      TableFromModelChain<double>(start_[mounting], p.mountings[mounting].data());
  return TableFromModel(x.rotation, x.translation);
}

Intrinsics RigModel::IntrinsicsOf(const RigParameters& p, int lens) const {
  Intrinsics in = intrinsics_[lens];
  const auto& d = p.lenses[lens];
  in.fl_x *= std::exp(d[0]);
  in.fl_y *= std::exp(d[0]);
  in.cx += d[1];
  in.cy += d[2];
  in.k1 += d[3] * K1OfCorner(intrinsics_[lens]);
  return in;
}

}  // namespace scan
