#include "reconstruction/appearance/appearance.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "drivers/base/units.h"

namespace scan {
namespace {

std::vector<RingMap> MapsOf(const std::vector<SurfaceFeature>& features) {
  std::vector<RingMap> maps;
  for (const SurfaceFeature& feature : features) maps.push_back(feature.map);
  return maps;
}

Result<cv::Mat> ReadPhoto(const Photo& photo, const Intrinsics& intrinsics) {
  cv::Mat picture;
  try {
    picture = cv::imread(photo.path.string(), cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    picture.release();
  }
  if (picture.empty())
    return BadInput("the photograph cannot be read", photo.path.string(),
                    "check that the file is whole");
  if (picture.cols != intrinsics.w || picture.rows != intrinsics.h)
    return BadInput("the photograph is of another size than its camera says", photo.path.string(),
                    "check w and h of the camera");
  return picture;
}

Result<std::vector<ViewColours>> ColoursOf(const TurningGrid& grid, const TriangleMesh& mesh,
                                           const PhotoSet& photos, std::span<const Mask> masks,
                                           const Poses& poses, std::span<const std::size_t> views,
                                           const AppearanceOptions& options,
                                           const std::stop_token& stop) {
  std::vector<ViewColours> colours;
  for (const std::size_t i : views) {
    if (stop.stop_requested()) return Cancelled("appearance");
    const Photo& photo = photos.photos[i];
    SCAN_TRY(const cv::Mat picture, ReadPhoto(photo, photos.intrinsics(photo)));
    Intrinsics solved = IntrinsicsOf(poses, poses.views[i], photos.intrinsics(photo));
    colours.push_back(BackProject(grid, mesh, picture, masks[i], poses.views[i].camera_from_model,
                                  solved, options.colours));
    colours.back().lighting = photo.aim;
  }
  return colours;
}

// Size and sigma of a cos + b sin in the views' turns, weighted by their sigmas.
void FitOnceRound(const PhotoSet& photos, AppearanceFinding& finding) {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  int count = 0;
  for (std::size_t k = 0; k < finding.views.size(); ++k) {
    const auto& logged = photos.photos[finding.views[k]].turntable_rad;
    const ViewTurn& turn = finding.view_turns[k];
    if (!logged || !std::isfinite(turn.sigma_rad)) continue;
    const Eigen::Vector3d row(1, std::cos(logged->nominal), std::sin(logged->nominal));
    const double w = 1 / std::max(turn.sigma_rad * turn.sigma_rad, 1e-10);
    H += w * row * row.transpose();
    b += w * turn.turn_rad * row;
    ++count;
  }
  if (count < 5 || H.determinant() < 1e-9 * std::pow(H(0, 0), 3)) return;
  const Eigen::Matrix3d covariance = H.inverse();
  const Eigen::Vector3d fit = covariance * b;
  finding.once_round_rad = fit.tail<2>().norm();
  finding.once_round_sigma_rad = std::sqrt(0.5 * (covariance(1, 1) + covariance(2, 2)));
}

// By which an error of the pose looks like a turn.
double PoseSigma(const TurningGrid& grid, const PhotoSet& photos, const Poses& poses,
                 const AppearanceOptions& options, std::size_t view) {
  const double focal_px = photos.intrinsics(photos.photos[view]).fl_x;
  const double distance_mm = (poses.views[view].camera_from_model * grid.point).z();
  const double radius_mm = *std::max_element(grid.radius_mm.begin(), grid.radius_mm.end());
  return options.pose_sigma_px * distance_mm / focal_px / radius_mm;
}

void TakeOffViewTurns(const TurningGrid& grid, const PhotoSet& photos, const Poses& poses,
                      const AppearanceOptions& options, std::vector<ViewColours>& colours,
                      AppearanceFinding& finding) {
  finding.before = finding.after = AgreementOf(colours);
  finding.view_turns = ViewTurns(grid, colours, finding.before.noise, options.view_turns);
  finding.corrected.assign(colours.size(), false);
  double squares = 0, count = 0;
  for (std::size_t k = 0; k < colours.size(); ++k) {
    ViewTurn& turn = finding.view_turns[k];
    if (!std::isfinite(turn.sigma_rad)) continue;
    turn.sigma_rad =
        std::hypot(turn.sigma_rad, PoseSigma(grid, photos, poses, options, finding.views[k]));
    finding.corrected[k] = std::abs(turn.turn_rad) > options.least_view_sigmas * turn.sigma_rad;
    if (finding.corrected[k]) colours[k] = Turned(colours[k], turn.turn_rad);
    squares += std::pow(finding.corrected[k] ? 0 : turn.turn_rad, 2) + std::pow(turn.sigma_rad, 2);
    count += 1;
  }
  finding.view_spread_rad = count > 0 ? std::sqrt(squares / count) : 0;
  finding.after = AgreementOf(colours);
  FitOnceRound(photos, finding);
}

void SearchAlone(const TurnSearch& search, std::span<const ViewColours> colours,
                 const AppearanceOptions& options, AppearanceFinding& finding) {
  finding.searched_alone =
      std::min(colours.size(), static_cast<std::size_t>(std::max(0, options.views_alone)));
  for (std::size_t k = 0; k < finding.searched_alone; ++k) {
    const ViewColours& view = colours[k * colours.size() / finding.searched_alone];
    const TurnEstimate alone = search.Find(view.colour);
    finding.agree_alone += std::abs(std::remainder(alone.turn_rad - finding.turn.turn_rad,
                                                   2 * kPi)) < options.alone_agrees_rad;
  }
}

}  // namespace

Result<AppearanceFinding> FindAppearance(const TriangleMesh& mesh, const Volume* volume,
                                         const PhotoSet& photos, std::span<const Mask> masks,
                                         const Poses& poses, const FreeDirection& direction,
                                         const AppearanceOptions& options, std::stop_token stop) {
  AppearanceFinding finding;
  finding.direction = direction;
  for (std::size_t i = 0; i < poses.views.size(); ++i)
    if (poses.views[i].status == ViewStatus::accepted && poses.views[i].mounting == direction.of)
      finding.views.push_back(i);
  const MeshBvh bvh(mesh);
  const TurningGrid grid =
      MakeTurningGrid(mesh, bvh, direction.axis, direction.point, options.grid);
  if (grid.rings < options.search.bands || finding.views.empty()) {
    finding.turn.reason = "too little of the surface stands round the axis";
    return finding;
  }
  SCAN_TRY(std::vector<ViewColours> colours,
           ColoursOf(grid, mesh, photos, masks, poses, finding.views, options, stop));
  LevelLight(colours);
  TakeOffViewTurns(grid, photos, poses, options, colours, finding);
  if (stop.stop_requested()) return Cancelled("appearance");
  const std::vector<RingMap> features =
      MapsOf(SurfaceFeatures(grid, bvh, volume, options.features));
  const TurnSearch search(grid, features, options.search);
  finding.turn = search.Find(Merged(colours));
  if (finding.turn.decided) SearchAlone(search, colours, options, finding);
  return finding;
}

Result<std::vector<AppearanceFinding>> DecideFreeTurns(const TriangleMesh& mesh,
                                                       const Volume* volume, const PhotoSet& photos,
                                                       std::span<const Mask> masks,
                                                       const AppearanceOptions& options,
                                                       Poses& poses, const ProgressFn& progress,
                                                       std::stop_token stop) {
  std::vector<AppearanceFinding> findings;
  if (!options.enabled) return findings;
  const std::vector<FreeDirection> free = poses.free_directions;
  const auto is_turn = [](const FreeDirection& d) {
    return d.kind == FreeDirection::Kind::rotation && d.scope == FreeDirection::Scope::mounting;
  };
  for (const FreeDirection& direction : free) {
    if (!is_turn(direction)) continue;
    // A ball has no axis to turn about.
    const auto turns = std::count_if(free.begin(), free.end(), [&](const FreeDirection& d) {
      return is_turn(d) && d.of == direction.of;
    });
    if (turns > 1) continue;
    Report(progress, "appearance", 0.0);
    SCAN_TRY(AppearanceFinding finding,
             FindAppearance(mesh, volume, photos, masks, poses, direction, options, stop));
    ApplyAppearance(mesh, photos, finding, options, poses);
    findings.push_back(std::move(finding));
    Report(progress, "appearance", 1.0);
  }
  return findings;
}

}  // namespace scan
