// What the colours decided, into the poses.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drivers/base/units.h"
#include "reconstruction/appearance/appearance.h"
#include "reconstruction/pose/joint_result.h"
#include "reconstruction/pose/observability.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan {
namespace {

using ModelFromModel = Transform<frame::Model, frame::Model>;

ModelFromModel TurnAbout(const FreeDirection& direction, double angle_rad) {
  const Eigen::Matrix3d turn = ExpSo3(angle_rad * direction.axis.normalized());
  return ModelFromModel(turn, direction.point - turn * direction.point);
}

// The posterior once the rotation `w` . `axis` (camera frame) was measured with `sigma_rad`. Rows
// beyond the pose are correlated with it and stay consistent.
template <class Matrix>
void MeasureTurn(const Eigen::Vector3d& axis, double sigma_rad, Matrix& covariance) {
  Eigen::VectorXd h = Eigen::VectorXd::Zero(covariance.rows());
  h.head<3>() = axis;
  const Eigen::VectorXd gain = covariance * h;
  covariance -= gain * gain.transpose() / (h.dot(gain) + sigma_rad * sigma_rad);
}

void SetSigma(const ContourMesh& mesh, const Intrinsics& intrinsics, const FreeDirection& direction,
              double sigma_rad, ViewPose& view) {
  const Eigen::Vector3d axis = view.camera_from_model.rotation() * direction.axis.normalized();
  MeasureTurn(axis, sigma_rad, view.covariance);
  if (view.covariance_with_lens.rows() != kEvidenceSize) return;
  MeasureTurn(axis, sigma_rad, view.covariance_with_lens);
  view.surface_sigma_px =
      SurfaceSigmaOf(mesh, view.camera_from_model, intrinsics, view.covariance_with_lens);
}

std::string AgreementText(const AppearanceFinding& finding) {
  return fmt::format(
      "views agree with each other within {:.2f} deg and share {:.0f} % of the "
      "colour's variance where they overlap",
      DegFromRad(finding.view_spread_rad), 100 * finding.after.share);
}

std::string DecisionText(const AppearanceFinding& finding) {
  const std::string about =
      fmt::format("about ({:.3f}, {:.3f}, {:.3f})", finding.direction.axis.x(),
                  finding.direction.axis.y(), finding.direction.axis.z());
  if (!finding.turn.decided)
    return fmt::format("Mounting {}: colour does not decide the turn {}: {}.", finding.direction.of,
                       about, finding.turn.reason);
  return fmt::format(
      "Mounting {}: the silhouettes do not show the turn {}; colour that follows what the CT shows "
      "under the surface decided it: sigma {:.2f} deg, {:.1f} standard errors before the next best "
      "turn; {} of {} views find it each alone; {}.",
      finding.direction.of, about, DegFromRad(finding.turn.sigma_rad),
      std::min(finding.turn.gap, 99.9), finding.agree_alone, finding.searched_alone,
      AgreementText(finding));
}

// What the views' own turns say of the turntable.
void NoteViewTurns(const AppearanceFinding& finding, Poses& poses) {
  std::string astray;
  double largest = 0;
  for (std::size_t k = 0; k < finding.views.size(); ++k) {
    if (!finding.corrected[k]) continue;
    astray += (astray.empty() ? "" : ", ") + poses.views[finding.views[k]].name;
    largest = std::max(largest, std::abs(finding.view_turns[k].turn_rad));
  }
  if (astray.empty()) return;
  poses.notes.push_back(fmt::format(
      "Mounting {}: colours on the surface show that views are turned against the others by up to "
      "{:.2f} deg: {}; they were turned back.",
      finding.direction.of, DegFromRad(largest), astray));
  if (finding.once_round_rad > std::max(4 * finding.once_round_sigma_rad, RadFromDeg(0.1)))
    poses.notes.push_back(fmt::format(
        "Mounting {}: the views' turns go once round with the turntable ({:.2f} deg): its axis is "
        "not where the poses have it. Calibrate the turntable's axis.",
        finding.direction.of, DegFromRad(finding.once_round_rad)));
}

}  // namespace

void ApplyAppearance(const TriangleMesh& mesh, const PhotoSet& photos,
                     const AppearanceFinding& finding, const AppearanceOptions& options,
                     Poses& poses) {
  const bool decided = finding.turn.decided;
  const ModelFromModel turn = TurnAbout(finding.direction, decided ? finding.turn.turn_rad : 0.0);
  for (std::size_t k = 0; k < finding.corrected.size(); ++k) {
    if (!finding.corrected[k]) continue;
    ViewPose& view = poses.views[finding.views[k]];
    view.camera_from_model =
        view.camera_from_model * TurnAbout(finding.direction, finding.view_turns[k].turn_rad);
  }
  if (finding.corrected.size() == finding.views.size()) NoteViewTurns(finding, poses);
  if (decided) {
    // The angle itself is no longer arbitrary.
    const std::string arbitrary = Sentence(finding.direction);
    std::erase(poses.notes, arbitrary);
    std::erase_if(poses.free_directions, [&](const FreeDirection& d) {
      return d.kind == finding.direction.kind && d.scope == finding.direction.scope &&
             d.of == finding.direction.of;
    });
    for (MountingEstimate& mounting : poses.mountings)
      if (mounting.id == finding.direction.of)
        mounting.table_from_model = mounting.table_from_model * turn;
    const ContourMesh contours(mesh);
    for (std::size_t i = 0; i < poses.views.size(); ++i) {
      ViewPose& view = poses.views[i];
      if (view.mounting != finding.direction.of) continue;
      view.camera_from_model = view.camera_from_model * turn;
      const auto at = std::find(finding.views.begin(), finding.views.end(), i);
      if (at == finding.views.end()) continue;
      const auto k = static_cast<std::size_t>(at - finding.views.begin());
      const ViewTurn& own = finding.view_turns[k];
      const double own_sigma = std::min(own.sigma_rad, options.view_turns.prior_sigma_rad);
      SetSigma(contours, IntrinsicsOf(poses, view, photos.intrinsics(photos.photos[i])),
               finding.direction, std::hypot(finding.turn.sigma_rad, own_sigma), view);
    }
  }
  poses.notes.push_back(DecisionText(finding));
}

}  // namespace scan
