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

std::string StepsNote(const PhotoSet& photos, const RigParameters& parameters,
                      const RigPosterior& posterior, const RigChange& change) {
  const double turned_rad = parameters.epochs[static_cast<std::size_t>(change.after)] -
                            parameters.epochs[static_cast<std::size_t>(change.before)];
  const double sigma_rad = SigmaOfDifference(posterior, posterior.layout.epoch(change.after),
                                             posterior.layout.epoch(change.before));
  return fmt::format(
      "From view {} on the turntable stands {:+.2f}° (σ {:.2f}°) from where the log says: lost "
      "steps, or something turned it. Compensated; home it again, and run it slower or with more "
      "current.",
      photos.photos[static_cast<std::size_t>(change.view)].name, DegFromRad(turned_rad),
      DegFromRad(sigma_rad));
}

std::string MovedNote(const PhotoSet& photos, const RigModel& rig, const RigParameters& parameters,
                      const RigPosterior& posterior, const RigChange& change,
                      const Eigen::Vector3d& specimen) {
  const TableFromModel before = rig.TableFromModelOf(parameters, change.before);
  const TableFromModel after = rig.TableFromModelOf(parameters, change.after);
  const Vector6d motion = MotionBetween(before, after, before * specimen);
  const int a = posterior.layout.mounting(change.after);
  const int b = posterior.layout.mounting(change.before);
  const Eigen::Vector3d axis = motion.head<3>().normalized();
  // The view before it of the same placing.
  int last = change.view - 1;
  while (last > 0 && rig.views()[last].mounting != change.before) --last;
  return fmt::format(
      "Between views {} and {} the specimen moved on the table: it turned by {:.2f}° (σ {:.2f}°) "
      "and its mass centre went {:.2f} mm. Compensated by a placing of its own, {}; fasten the "
      "specimen.",
      photos.photos[static_cast<std::size_t>(last)].name,
      photos.photos[static_cast<std::size_t>(change.view)].name,
      DegFromRad(motion.head<3>().norm()), DegFromRad(SigmaAlong(posterior, a, b, axis)),
      motion.tail<3>().norm(), rig.mounting_ids()[static_cast<std::size_t>(change.after)]);
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
      notes.push_back(StepsNote(photos, parameters, posterior, change));
      split[static_cast<std::size_t>(change.after)] = true;
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
