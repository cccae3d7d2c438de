#include "reconstruction/pose/found_turntable.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <vector>

#include "drivers/base/units.h"
#include "reconstruction/pose/rig_model.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan {
namespace {

constexpr std::size_t kLeastViews = 6;
constexpr double kLeastSpan_rad = 30 * kPi / 180;
constexpr double kMostChi2 = 22.46;  // of 6 degrees of freedom, 99.9 %
// Of the found rig as a log: the solve itself tells them better.
constexpr double kSigmaTurn_rad = 5 * kPi / 180;
constexpr RigidSigma kSigmaAim{5 * kPi / 180, 50};

struct Ring {
  CameraFromStation camera_from_station;
  TableFromModel table_from_model;
  std::vector<double> turns_rad;
};

// A point of the axis: where what moves along with every turn stays; along the axis where the
// specimen's centre is.
Eigen::Vector3d PointOfAxis(std::span<const CameraFromModel> poses, const Eigen::Vector3d& axis,
                            const Eigen::Vector3d& centre) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero(), middle = Eigen::Vector3d::Zero();
  for (const CameraFromModel& pose : poses) middle += pose * centre;
  middle /= static_cast<double>(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Eigen::Matrix3d turn = poses[i].rotation() * poses[j].rotation().transpose();
      const Eigen::Matrix3d stays = Eigen::Matrix3d::Identity() - turn;
      normal += stays.transpose() * stays;
      right += stays.transpose() * (poses[i].translation() - turn * poses[j].translation());
    }
  }
  const double along = normal.trace();
  normal += along * axis * axis.transpose();
  right += along * axis.dot(middle) * axis;
  return normal.ldlt().solve(right);
}

double TurnAboutZ(const Eigen::Matrix3d& r) {
  return std::atan2(r(1, 0) - r(0, 1), r(0, 0) + r(1, 1));
}

// The rig that comes nearest to the poses.
Ring RingOf(std::span<const CameraFromModel> poses, const Eigen::Vector3d& centre) {
  Eigen::Vector3d axis = CommonAxis(poses);
  if (axis.y() > 0) axis = -axis;  // the camera's y runs down
  const Eigen::Vector3d point = PointOfAxis(poses, axis, centre);
  Eigen::Matrix3d frame;  // camera_from_station
  frame.col(2) = axis;
  frame.col(0) = axis.unitOrthogonal();
  frame.col(1) = axis.cross(frame.col(0));
  Ring ring{CameraFromStation(frame, point), {}, {}};
  // Turns against the first view; then, twice, against the mean of all turned back.
  Eigen::Matrix3d rotation = frame.transpose() * poses.front().rotation();
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  for (int round = 0; round < 3; ++round) {
    ring.turns_rad.clear();
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    place.setZero();
    for (const CameraFromModel& pose : poses) {
      const Eigen::Matrix3d seen = frame.transpose() * pose.rotation();
      const double turn = TurnAboutZ(seen * rotation.transpose());
      const Eigen::Matrix3d back =
          Eigen::AngleAxisd(-turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
      ring.turns_rad.push_back(turn);
      sum += back * seen;
      place += back * frame.transpose() * (pose.translation() - point) /
               static_cast<double>(poses.size());
    }
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
    rotation = svd.matrixU() * svd.matrixV().transpose();
  }
  ring.table_from_model = TableFromModel(rotation, place);
  return ring;
}

CameraFromTable CameraFromTableOf(const Ring& ring, double turn_rad) {
  return ring.camera_from_station * MakeStationFromTable(turn_rad);
}

double TurnOf(const Ring& ring, const CameraFromModel& pose) {
  return TurnAboutZ(ring.camera_from_station.rotation().transpose() * pose.rotation() *
                    ring.table_from_model.rotation().transpose());
}

double OffRing_rad(const Ring& ring, double turn_rad, const CameraFromModel& pose) {
  return AngleBetween((CameraFromTableOf(ring, turn_rad) * ring.table_from_model).rotation(),
                      pose.rotation());
}

bool HasFreeDirection(const Poses& poses, const ViewPose& view) {
  return std::any_of(poses.free_directions.begin(), poses.free_directions.end(),
                     [&](const FreeDirection& free) { return free.of == view.name; });
}

double Chi2(const Ring& ring, double turn_rad, const ViewPose& view) {
  const CameraFromModel pose = CameraFromTableOf(ring, turn_rad) * ring.table_from_model;
  const Vector6d off = MotionBetween(view.camera_from_model, pose, Eigen::Vector3d::Zero());
  return off.dot(view.covariance.ldlt().solve(off));
}

bool Spans(const Ring& ring) {
  for (const double a : ring.turns_rad)
    if (std::abs(std::remainder(a - ring.turns_rad.front(), 2 * kPi)) > kLeastSpan_rad) return true;
  return false;
}

}  // namespace

Eigen::Vector3d CommonAxis(std::span<const CameraFromModel> poses) {
  Eigen::Matrix3d moved = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Eigen::Matrix3d off =
          poses[i].rotation() * poses[j].rotation().transpose() - Eigen::Matrix3d::Identity();
      moved += off.transpose() * off;
    }
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(moved).eigenvectors().col(0);
}

std::optional<FoundTurntable> FindTurntable(const PhotoSet& photos, const Poses& poses,
                                            const Eigen::Vector3d& centre) {
  std::vector<std::size_t> members, doubtful;
  for (std::size_t i = 0; i < poses.views.size(); ++i) {
    if (poses.views[i].status != ViewStatus::accepted) continue;
    if (photos.photos[i].aim != photos.photos.front().aim ||
        photos.photos[i].mounting_id != photos.photos.front().mounting_id)
      return std::nullopt;
    (HasFreeDirection(poses, poses.views[i]) ? doubtful : members).push_back(i);
  }
  const std::size_t determined = members.size();
  // Views that stand elsewhere are left out, the farthest first.
  while (members.size() >= kLeastViews && 4 * members.size() >= 3 * determined) {
    std::vector<CameraFromModel> cameras;
    for (const std::size_t i : members) cameras.push_back(poses.views[i].camera_from_model);
    const Ring ring = RingOf(cameras, centre);
    std::size_t worst = 0;
    double worst_chi2 = -1;
    for (std::size_t k = 0; k < members.size(); ++k) {
      const double chi2 = Chi2(ring, ring.turns_rad[k], poses.views[members[k]]);
      if (chi2 > worst_chi2) {
        worst = k;
        worst_chi2 = chi2;
      }
    }
    if (!(worst_chi2 < kMostChi2)) {
      members.erase(members.begin() + static_cast<std::ptrdiff_t>(worst));
      continue;
    }
    if (!Spans(ring)) return std::nullopt;
    FoundTurntable found{photos, ring.table_from_model, 0};
    found.photos.aims[photos.photos.front().aim].sigma = kSigmaAim;
    const auto log = [&](std::size_t view, double turn_rad) {
      Photo& photo = found.photos.photos[view];
      photo.camera_from_table = CameraFromTableOf(ring, turn_rad);
      photo.turntable_rad = AxisPrior{turn_rad, 0, kSigmaTurn_rad};
      photo.sigma_view = {};
      ++found.views;
    };
    for (std::size_t k = 0; k < members.size(); ++k) log(members[k], ring.turns_rad[k]);
    for (const std::size_t i : doubtful) {
      const double turn_rad = TurnOf(ring, poses.views[i].camera_from_model);
      if (OffRing_rad(ring, turn_rad, poses.views[i].camera_from_model) < kSigmaTurn_rad)
        log(i, turn_rad);
    }
    return found;
  }
  return std::nullopt;
}

}  // namespace scan
