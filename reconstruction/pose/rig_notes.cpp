#include "reconstruction/pose/rig_notes.h"

#include <fmt/format.h>

#include <cmath>

#include "drivers/base/units.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan {
namespace {

// Standard deviation of x[a] - x[b].
double SigmaOfDifference(const RigPosterior& posterior, int a, int b) {
  const auto& cov = posterior.covariance;
  return std::sqrt(std::max(0.0, cov(a, a) + cov(b, b) - 2 * cov(a, b)));
}

// Along `direction`, of the difference of the three parameters from `a` and from `b` on.
double SigmaAlong(const RigPosterior& posterior, int a, int b, const Eigen::Vector3d& direction) {
  const auto& cov = posterior.covariance;
  const Eigen::Matrix3d difference =
      cov.block<3, 3>(a, a) + cov.block<3, 3>(b, b) - cov.block<3, 3>(a, b) - cov.block<3, 3>(b, a);
  return std::sqrt(std::max(0.0, direction.dot(difference * direction)));
}

// The last view taken before `view` of those that `same` says belong with it; `view` without any.
template <class Same>
int TakenBefore(const RigModel& rig, int view, Same&& same) {
  const auto taken = [&](int i) { return rig.views()[static_cast<std::size_t>(i)].taken; };
  int last = view;
  for (int i = 0; i < static_cast<int>(rig.views().size()); ++i) {
    if (!same(i) || taken(i) >= taken(view)) continue;
    if (last == view || taken(i) > taken(last)) last = i;
  }
  return last;
}

std::string StepsNote(const PhotoSet& photos, const RigModel& rig, const RigParameters& parameters,
                      const RigPosterior& posterior, const RigChange& change) {
  const auto epoch_of = [&](int i) {
    return photos.photos[static_cast<std::size_t>(i)].reference_epoch;
  };
  const int last = TakenBefore(rig, change.view, [&](int i) {
    return rig.views()[i].turns && epoch_of(i) == epoch_of(change.view);
  });
  const int before = rig.views()[last].epoch;
  const int after = rig.views()[change.view].epoch;
  const double turned_rad = parameters.epochs[static_cast<std::size_t>(after)] -
                            parameters.epochs[static_cast<std::size_t>(before)];
  const double sigma_rad =
      SigmaOfDifference(posterior, posterior.layout.epoch(after), posterior.layout.epoch(before));
  return fmt::format(
      "From view {} on the turntable stands {:+.2f}° (σ {:.2f}°) from where the log and the views "
      "before it put it: lost steps, or something turned it. Compensated; home it again, and run "
      "it slower or with more current.",
      photos.photos[static_cast<std::size_t>(change.view)].name, DegFromRad(turned_rad),
      DegFromRad(sigma_rad));
}

std::string MovedNote(const PhotoSet& photos, const RigModel& rig, const RigParameters& parameters,
                      const RigPosterior& posterior, const RigChange& change,
                      const Eigen::Vector3d& specimen) {
  const auto mounting_of = [&](int i) {
    return photos.photos[static_cast<std::size_t>(i)].mounting_id;
  };
  const int last = TakenBefore(rig, change.view, [&](int i) {
    return rig.views()[i].logged && mounting_of(i) == mounting_of(change.view);
  });
  const int mounting = rig.views()[change.view].mounting, left = rig.views()[last].mounting;
  const TableFromModel before = rig.TableFromModelOf(parameters, left);
  const TableFromModel after = rig.TableFromModelOf(parameters, mounting);
  const Vector6d motion = MotionBetween(before, after, before * specimen);
  const int a = posterior.layout.mounting(mounting);
  const int b = posterior.layout.mounting(left);
  const Eigen::Vector3d axis = motion.head<3>().normalized();
  return fmt::format(
      "Between views {} and {} the specimen moved on the table: it turned by {:.2f}° (σ {:.2f}°) "
      "and its mass centre went {:.2f} mm. Compensated by a placing of its own, {}; fasten the "
      "specimen.",
      photos.photos[static_cast<std::size_t>(last)].name,
      photos.photos[static_cast<std::size_t>(change.view)].name,
      DegFromRad(motion.head<3>().norm()), DegFromRad(SigmaAlong(posterior, a, b, axis)),
      motion.tail<3>().norm(), rig.mounting_ids()[static_cast<std::size_t>(mounting)]);
}

}  // namespace

std::vector<std::string> RigNotes(const PhotoSet& photos, const RigModel& rig,
                                  const RigParameters& parameters, const RigPosterior& posterior,
                                  std::span<const RigChange> changes,
                                  const Eigen::Vector3d& specimen) {
  std::vector<std::string> notes;
  std::vector<bool> split(rig.epoch_names().size(), false);
  for (const RigChange& change : changes) {
    if (change.kind == RigChange::Kind::steps_lost) {
      notes.push_back(StepsNote(photos, rig, parameters, posterior, change));
      split[static_cast<std::size_t>(rig.views()[change.view].epoch)] = true;
    } else if (change.kind == RigChange::Kind::specimen_moved) {
      notes.push_back(MovedNote(photos, rig, parameters, posterior, change, specimen));
    }
  }
  for (std::size_t e = 1; e < split.size(); ++e) {
    if (split[e]) continue;
    const double turned_rad = parameters.epochs[e] - parameters.epochs[0];
    const double sigma_rad = SigmaOfDifference(
        posterior, posterior.layout.epoch(static_cast<int>(e)), posterior.layout.epoch(0));
    if (std::abs(turned_rad) < 3 * sigma_rad) continue;
    notes.push_back(fmt::format(
        "The turntable's zero of reference epoch {} differs from that of epoch {} by {:+.3f}° "
        "(σ {:.3f}°): homing did not come back to the same place. Compensated.",
        rig.epoch_names()[e], rig.epoch_names()[0], DegFromRad(turned_rad), DegFromRad(sigma_rad)));
  }
  return notes;
}

std::string ReasonOfViewAlone(const CameraFromModel& seen, const CameraFromModel& expected,
                              const Eigen::Vector3d& specimen) {
  const Vector6d motion = MotionBetween(expected, seen, expected * specimen);
  return fmt::format(
      "this view alone shows the specimen {:.2f}° and {:.2f} mm from where the log and the other "
      "views put it: it, the table or the camera moved for this photograph",
      DegFromRad(motion.head<3>().norm()), motion.tail<3>().norm());
}

}  // namespace scan
