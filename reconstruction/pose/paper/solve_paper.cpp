#include "reconstruction/pose/paper/solve_paper.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <map>
#include <tuple>

#include "drivers/base/rng.h"
#include "drivers/base/units.h"
#include "reconstruction/pose/paper/paper_search.h"
#include "reconstruction/pose/pose_input.h"
#include "reconstruction/pose/start_search.h"

namespace scan {
namespace {

using Parameters = std::array<double, 6>;

// Published: scale coefficients s and offsets h_k of the central differences.
constexpr Parameters kScale{1e-4, 1e-4, 1e1, 1e-7, 1e-7, 1e-7};
constexpr double kOffset = 0.1 * 2 * kPi / 360;
constexpr Parameters kOffsets{kOffset, kOffset, 10, kOffset, kOffset, kOffset};
// Hill climbing: r by 0.1 mm, angles by 10^-2 rad at most.
constexpr Parameters kWalk{1e-2, 1e-2, 0.1, 1e-2, 1e-2, 1e-2};

double Cost(const ReducedPicture& picture, const TriangleMesh& mesh,
            const Eigen::Vector3d& mass_centre, const Parameters& c) {
  return CostOfPose(picture, mesh, CameraFromModelOf(PaperCamera::From(c), mass_centre)).l1_px;
}

std::optional<double> DistanceOf(const PhotoSet& photos, const Photo& photo) {
  if (photos.approx_distance_mm) return photos.approx_distance_mm;
  if (photo.camera_from_table) return CameraCentre(*photo.camera_from_table).norm();
  const Aim& aim = photos.aims[photo.aim];
  if (!aim.camera_from_lift) return std::nullopt;
  const double lift_mm = photo.lift_mm ? photo.lift_mm->nominal : 0.0;
  return CameraCentre(*aim.camera_from_lift *
                      MakeLiftFromStation(lift_mm, photos.lift_direction_in_station))
      .norm();
}

// Templates are shared by photographs with the same reduced camera and distance.
class TemplateStore {
 public:
  TemplateStore(const TriangleMesh& mesh, const Eigen::Vector3d& mass_centre,
                const PaperOptions& options)
      : mesh_(mesh),
        mass_centre_(mass_centre),
        options_(options),
        directions_(IcosphereDirections(options.subdivisions)) {}

  const std::vector<PaperTemplate>& For(const Intrinsics& reduced, double r0_mm) {
    if (templates_.empty() || !(reduced == reduced_) || r0_mm != r0_mm_) {
      std::vector<double> distances;
      for (const double offset : options_.distance_offsets_mm)
        if (r0_mm + offset > 0) distances.push_back(r0_mm + offset);
      templates_ = RenderTemplates(mesh_, mass_centre_, directions_, distances, reduced);
      reduced_ = reduced;
      r0_mm_ = r0_mm;
    }
    return templates_;
  }

 private:
  const TriangleMesh& mesh_;
  Eigen::Vector3d mass_centre_;
  const PaperOptions& options_;
  std::vector<Eigen::Vector3d> directions_;
  std::vector<PaperTemplate> templates_;
  Intrinsics reduced_;
  double r0_mm_ = 0;
};

ViewPose EmptyView(const PhotoSet& photos, const Photo& photo) {
  ViewPose view;
  view.name = photo.name;
  view.aim = photos.aims[photo.aim].id;
  view.lens_state = photos.lens_states[photos.aims[photo.aim].lens_state].id;
  view.mounting = photo.mounting_id;
  view.covariance.setZero();
  view.covariance.diagonal() << 10, 10, 10, 1e6, 1e6, 1e6;  // rad^2, mm^2: nothing is claimed
  return view;
}

}  // namespace

PaperCamera DescendPaper(const ReducedPicture& picture, const TriangleMesh& mesh,
                         const Eigen::Vector3d& mass_centre, const PaperCamera& start,
                         const PaperOptions& options, std::stop_token stop) {
  Parameters c = start.array();
  double cost = Cost(picture, mesh, mass_centre, c);
  double h = 1;
  for (int step = 0; step < options.descent_steps && !stop.stop_requested(); ++step) {
    Parameters gradient{};
    for (std::size_t k = 0; k < 6; ++k) {
      Parameters up = c, down = c;
      up[k] += kOffsets[k];
      down[k] -= kOffsets[k];
      gradient[k] =
          (Cost(picture, mesh, mass_centre, up) - Cost(picture, mesh, mass_centre, down)) /
          (2 * kOffsets[k]);
    }
    // Line search: from twice the last step, halved until the cost falls.
    bool better = false;
    h = std::min(2 * h, 64.0);
    for (int halving = 0; halving < 16 && !better; ++halving) {
      Parameters next = c;
      for (std::size_t k = 0; k < 6; ++k) next[k] -= h * kScale[k] * gradient[k];  // Eq 6
      const double next_cost = Cost(picture, mesh, mass_centre, next);
      better = next_cost < cost;
      if (better) {
        c = next;
        cost = next_cost;
      } else {
        h *= 0.5;
      }
    }
    if (!better) break;
  }
  return PaperCamera::From(c);
}

PaperCamera ClimbPaper(const ReducedPicture& picture, const TriangleMesh& mesh,
                       const Eigen::Vector3d& mass_centre, const PaperCamera& start,
                       const PaperOptions& options, std::uint64_t seed, std::stop_token stop) {
  struct Chain {
    Parameters c;
    double cost;
  };
  const Chain first{start.array(), Cost(picture, mesh, mass_centre, start.array())};
  std::vector<Chain> chains(static_cast<std::size_t>(std::max(1, options.chains)), first);
  tbb::parallel_for(std::size_t{0}, chains.size(), [&](std::size_t i) {
    Rng rng(seed * 1000003 + i);
    Chain& chain = chains[i];
    for (int step = 0; step < options.hill_steps && !stop.stop_requested(); ++step) {
      Parameters next = chain.c;
      const auto k = static_cast<std::size_t>(rng.Below(6));
      next[k] += rng.Uniform(-kWalk[k], kWalk[k]);
      const double cost = Cost(picture, mesh, mass_centre, next);
      if (cost < chain.cost) chain = {next, cost};
    }
  });
  const Chain* best = &first;
  for (const Chain& chain : chains)
    if (chain.cost < best->cost) best = &chain;
  return PaperCamera::From(best->c);
}

Result<Poses> SolvePaper(const TriangleMesh& mesh, const PhotoSet& photos,
                         std::span<const Mask> masks, const PaperOptions& options,
                         const ProgressFn& progress, std::stop_token stop) {
  SCAN_CHECK(CheckPoseInput(mesh, photos, masks));
  if (options.subdivisions < 0 || options.subdivisions > 6 || options.distance_offsets_mm.empty() ||
      options.angle_step_deg < 1 || options.angle_step_deg > 360 || options.longest_side < 16)
    return BadInput("an option of the search is out of range", "paper",
                    "subdivisions 0 to 6, at least one distance, angle step 1 to 360 degrees");
  const Eigen::Vector3d mass_centre = MassCentre(mesh);
  TemplateStore store(mesh, mass_centre, options);
  Poses poses;
  poses.method = "paper";
  poses.model = options.model;
  for (const LensState& lens : photos.lens_states)
    poses.lens_states[lens.id].intrinsics = lens.intrinsics;
  poses.notes.push_back(
      "Each photograph was solved alone by its silhouette, without uncertainty: a low cost does "
      "not "
      "show that the pose is right where the specimen is symmetric.");
  for (std::size_t i = 0; i < photos.photos.size(); ++i) {
    const Photo& photo = photos.photos[i];
    Report(progress, "poses: paper",
           static_cast<double>(i) / static_cast<double>(photos.photos.size()));
    ViewPose view = EmptyView(photos, photo);
    const std::optional<double> r0_mm = DistanceOf(photos, photo);
    if (!r0_mm)
      return BadInput("the distance of the camera is not known", photo.name,
                      "give approx_distance_mm or nominal poses");
    const ReducedPicture picture =
        ReducePicture(masks[i], photos.intrinsics(photo), options.longest_side);
    if (picture.empty()) {
      view.reason = "the mask is empty: no specimen was found in the photograph";
      poses.views.push_back(view);
      continue;
    }
    const PaperStart start =
        SearchTemplates(store.For(picture.intrinsics, *r0_mm), picture, options.angle_step_deg);
    if (!std::isfinite(start.cost_px)) {
      view.reason =
          "no rendered silhouette falls into the picture: the distance or the focal length "
          "is far off";
      poses.views.push_back(view);
      continue;
    }
    const PaperCamera descended =
        DescendPaper(picture, mesh, mass_centre, start.camera, options, stop);
    const PaperCamera found =
        ClimbPaper(picture, mesh, mass_centre, descended, options, options.seed + i, stop);
    if (stop.stop_requested()) return Cancelled("pose");
    view.camera_from_model = CameraFromModelOf(found, mass_centre);
    const PictureCost cost = CostOfPose(picture, mesh, view.camera_from_model);
    view.cost_px = cost.l2_px;
    view.cost_l1_px = cost.l1_px;
    view.contour_rms_px = cost.l2_px * photos.intrinsics(photo).w / picture.intrinsics.w;
    if (cost.l1_px < options.gate_px) {
      view.status = ViewStatus::accepted;
    } else {
      view.reason =
          fmt::format("cost {:.2f} is not below the gate of {:.2f}", cost.l1_px, options.gate_px);
    }
    poses.views.push_back(view);
  }
  return poses;
}

}  // namespace scan
