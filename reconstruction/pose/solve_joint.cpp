#include "reconstruction/pose/solve_joint.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <iterator>
#include <optional>

#include "reconstruction/pose/found_turntable.h"
#include "reconstruction/pose/joint_result.h"
#include "reconstruction/pose/mirror_image.h"
#include "reconstruction/pose/nominal_pose.h"
#include "reconstruction/pose/observability.h"
#include "reconstruction/pose/outline_distance.h"
#include "reconstruction/pose/picture_cost.h"
#include "reconstruction/pose/pose_input.h"
#include "reconstruction/pose/pose_spectrum.h"
#include "reconstruction/pose/rig_attempt.h"
#include "reconstruction/pose/rig_notes.h"
#include "reconstruction/pose/stated_scale.h"

namespace scan {
namespace {

RefineOptions ScaledTo(RefineOptions options, double scale) {
  options.first_window_px *= scale;
  options.last_window_px = std::max(4.0, options.last_window_px * scale);
  // Not more in larger pictures: the noise of an outline hangs together over a few pixels whatever
  // their size, and samples 8 px apart would leave half of it unused.
  options.spacing_px = std::max(2.0, options.spacing_px * std::min(1.0, scale));
  options.correlation_floor_px *= scale;
  options.centre_beyond_px *= scale;
  return options;
}

RigPriors ScaledTo(RigPriors priors, double scale) {
  priors.mask_bias_px *= scale;
  return priors;
}

std::vector<PhotoContour> PhotoContours(std::span<const Mask> masks) {
  std::vector<PhotoContour> photos(masks.size());
  tbb::parallel_for(std::size_t{0}, masks.size(),
                    [&](std::size_t i) { photos[i] = MakePhotoContour(masks[i]); });
  return photos;
}

// Focal length, principal point and distortion are freed only where the data know them better than
// half of their prior: else they would only soak up what the model leaves out. True when one was
// freed.
bool FreeWhatIsSeen(RigModel& rig, const RigPosterior& posterior) {
  bool freed = false;
  for (int lens = 0; lens < static_cast<int>(rig.lens_sigma().size()); ++lens) {
    for (int k = 0; k < kLensSize; ++k) {
      const int at = posterior.layout.lens(lens) + k;
      if (std::sqrt(posterior.covariance(at, at)) >= 0.5 * posterior.prior_sigma[at]) continue;
      freed |= rig.held(lens, k);
      rig.set_held(lens, k, false);
    }
  }
  return freed;
}

// A view's own deviations in units of their priors.
double ViewPriorChi2(const RigPosterior& posterior, const RigParameters& parameters, int view) {
  double chi2 = 0;
  for (int k = 0; k < 8; ++k) {
    const double u =
        parameters.views[view][k] / posterior.prior_sigma[posterior.layout.view(view) + k];
    chi2 += u * u;
  }
  return chi2;
}

// What the steps of the solve share.
struct Evidence {
  const ContourMesh& mesh;
  std::span<const PhotoContour> photos;
  const JointOptions& options;
  RefineOptions refine;  // scaled to the photos
  double scale = 1;      // 1 px of a picture 1848 px wide
};

struct Judgement {
  Explained explained;
  std::string reason;
};

std::vector<Judgement> Judge(const Evidence& in, const RigModel& rig, const RefineResult& fit) {
  // A contour of coverage is rounded at the specimen's corners by about this, however small the
  // photograph.
  constexpr double kCornerPx = 0.25;
  const RigPosterior posterior = PosteriorOf(rig, fit);
  const double tolerance_px =
      in.options.acceptance.sigmas *
      std::max({PooledSigma(fit.fits), in.scale * in.options.acceptance.sigma_floor_px, kCornerPx});
  std::vector<Judgement> judgements(in.photos.size());
  tbb::parallel_for(std::size_t{0}, in.photos.size(), [&](std::size_t i) {
    const int view = static_cast<int>(i);
    Judgement& judgement = judgements[i];
    if (in.photos[i].empty()) {
      judgement.reason = "the mask is empty: no specimen was found in the photograph";
      return;
    }
    if (!rig.views()[i].logged && !rig.views()[i].placed) {
      judgement.reason = "no pose was found from which the mesh looks like the photograph";
      return;
    }
    const ViewState state{rig.CameraFromModelOf(fit.parameters, view),
                          rig.IntrinsicsOf(fit.parameters, rig.views()[i].lens),
                          fit.parameters.mask_bias_px};
    judgement.explained =
        ExplainedShares(in.mesh, in.photos[i], state, tolerance_px, in.refine.spacing_px);
    judgement.reason = RejectionReason(
        judgement.explained, ViewPriorChi2(posterior, fit.parameters, view), in.options.acceptance);
  });
  return judgements;
}

constexpr const char* kReversedNote =
    "The turntable runs the other way than its log says: with every angle negated the outlines "
    "fit. Mend the sign of the turntable in the station file.";

// Views that the change analysis took out say why, where their own outline has a pose to show.
void RejectViewsAlone(const Evidence& in, const RigModel& rig, const RigParameters& parameters,
                      std::span<const RigChange> changes, std::vector<Judgement>& judgements) {
  std::vector<bool> alone(in.photos.size(), false);
  for (const RigChange& change : changes)
    if (change.kind == RigChange::Kind::view_alone) alone[change.view] = true;
  const RigEvidence seen = EvidenceOfViewsAlone(in.mesh, rig, in.photos, alone, parameters,
                                                in.refine.correlation_floor_px, in.refine);
  for (std::size_t i = 0; i < in.photos.size(); ++i) {
    if (!seen[i]) continue;
    const Explained explained = ExplainedShares(
        in.mesh, in.photos[i], seen[i]->state, 1.5 * UnitPx(in.refine) + 0.5, in.refine.spacing_px);
    const bool has_pose = RejectionReason(explained, 0, {}).empty();
    if (!has_pose && !judgements[i].reason.empty()) continue;
    judgements[i].reason =
        ReasonOfViewAlone(seen[i]->state.camera_from_model,
                          rig.CameraFromModelOf(parameters, static_cast<int>(i)), in.mesh.centre);
  }
}

Poses Describe(const ContourMesh& mesh, const PhotoSet& photos, std::span<const Mask> masks,
               const RigModel& rig, const RefineResult& fit, const RigPosterior& posterior,
               std::span<const Judgement> judgements) {
  Poses poses;
  poses.method = "joint";
  DescribeShared(photos, rig, posterior, fit.parameters, poses);
  poses.views.resize(photos.photos.size());
  tbb::parallel_for(std::size_t{0}, photos.photos.size(), [&](std::size_t i) {
    const int index = static_cast<int>(i);
    const Photo& photo = photos.photos[i];
    ViewPose& view = poses.views[i];
    view.name = photo.name;
    view.aim = photos.aims[photo.aim].id;
    view.lens_state = photos.lens_states[photos.aims[photo.aim].lens_state].id;
    // A part of a mounting where the specimen was moved on the table.
    view.mounting =
        rig.views()[i].logged ? rig.mounting_ids()[rig.views()[i].mounting] : photo.mounting_id;
    view.reason = judgements[i].reason;
    view.status = view.reason.empty() ? ViewStatus::accepted : ViewStatus::rejected;
    view.contour_rms_px = judgements[i].explained.rms_px;
    if (!rig.views()[i].logged && !rig.views()[i].placed) {
      view.covariance = 1e6 * Matrix6d::Identity();
      return;
    }
    view.camera_from_model = rig.CameraFromModelOf(fit.parameters, index);
    const Intrinsics intrinsics = rig.IntrinsicsOf(fit.parameters, rig.views()[i].lens);
    const EvidenceMatrix covariance = ViewCovariance(rig, posterior, fit.parameters, index);
    view.covariance = covariance.topLeftCorner<6, 6>();
    view.covariance_with_lens = covariance;
    view.surface_sigma_px = SurfaceSigmaOf(mesh, view.camera_from_model, intrinsics, covariance);
    const ReducedPicture picture = ReducePicture(masks[i], intrinsics);
    if (picture.empty()) return;
    const PictureCost cost = CostOfPose(picture, mesh.mesh, view.camera_from_model);
    view.cost_px = cost.l2_px;
    view.cost_l1_px = cost.l1_px;
  });
  return poses;
}

PhotoSet WithoutPoses(PhotoSet photos) {
  for (Aim& aim : photos.aims) aim.camera_from_lift.reset();
  for (Photo& photo : photos.photos) {
    photo.camera_from_table.reset();
    photo.turntable_rad.reset();
  }
  return photos;
}

using Alternatives = std::vector<std::vector<AlternativePose>>;

// Finds a start for every photograph without a nominal pose and marks its mounting as known; one
// that has none is left out of `use`. Returns what each cannot decide between.
Alternatives StartViewsAlone(const Evidence& in, const PhotoSet& photos, RigModel& rig,
                             std::vector<bool>& use, std::vector<bool>& known,
                             const std::stop_token& stop) {
  constexpr double kUndecided = 4.6;  // log-likelihood: 1 to 100
  Alternatives alternatives(in.photos.size());
  std::vector<int> alone;
  for (std::size_t i = 0; i < in.photos.size(); ++i)
    if (use[i] && !rig.views()[i].logged) alone.push_back(static_cast<int>(i));
  if (alone.empty()) return alternatives;
  const double distance_mm = photos.approx_distance_mm.value_or(0);
  auto search = in.options.view_search;
  if (!search)
    search =
        std::make_shared<ViewSearch>(in.mesh, distance_mm, in.options.start, in.options.view_start);
  std::vector<std::vector<ViewCandidate>> found(alone.size());
  tbb::parallel_for(std::size_t{0}, alone.size(), [&](std::size_t k) {
    const auto i = static_cast<std::size_t>(alone[k]);
    found[k] = search->Solve(in.photos[i], rig.nominal_intrinsics(rig.views()[i].lens), distance_mm,
                             in.refine, stop);
  });
  for (std::size_t k = 0; k < alone.size(); ++k) {
    const auto i = static_cast<std::size_t>(alone[k]);
    use[i] = !found[k].empty();
    known[rig.views()[i].mounting] = true;
    if (found[k].empty()) continue;
    rig.set_view_start(alone[k], found[k].front().camera_from_model, in.mesh.centre);
    for (std::size_t c = 1; c < found[k].size(); ++c) {
      const double gap = found[k][c].misfit - found[k].front().misfit;
      if (gap < kUndecided) alternatives[i].push_back({found[k][c].camera_from_model, gap});
    }
  }
  return alternatives;
}

// Directions of mountings that are one view are the view's.
std::vector<FreeDirection> ByView(const PhotoSet& photos, std::vector<FreeDirection> free) {
  for (FreeDirection& direction : free) {
    if (!RigModel::IsViewMounting(direction.of)) continue;
    direction.scope = FreeDirection::Scope::view;
    for (const Photo& photo : photos.photos)
      if (' ' + photo.id == direction.of) direction.of = photo.name;
  }
  return free;
}

ObservabilityOptions ObservabilityFor(const RefineResult& fit) {
  ObservabilityOptions options;
  options.weights.correlation_px = fit.correlation.along_px;
  return options;
}

// What the accepted views of each mounting leave free.
std::vector<FreeDirection> FreeDirections(const ContourMesh& mesh, const RigModel& rig,
                                          const RefineResult& fit,
                                          std::span<const Judgement> judgements,
                                          const ObservabilityOptions& options) {
  const SmoothNormals smooth = SmoothNormalsOf(mesh, options.smoothing);
  std::vector<FreeDirection> free;
  for (int m = 0; m < static_cast<int>(rig.mounting_ids().size()); ++m) {
    std::vector<int> views;
    for (int i = 0; i < static_cast<int>(judgements.size()); ++i) {
      if (rig.views()[i].mounting == m && judgements[i].reason.empty() && fit.fits[i].evidence)
        views.push_back(i);
    }
    const auto found = FreeDirectionsOf(mesh, smooth, rig, fit, views, options);
    free.insert(free.end(), found.begin(), found.end());
  }
  return free;
}

// Residuals of a good fit leave nothing to ask: the scale is looked at only above a pixel of a
// picture 1848 px wide, or where few logged poses explain their outlines (then all of them count,
// from as far away as the solve began: some pose of another size may fit one outline).
void RejectRefutedScale(const Evidence& in, const RigModel& rig, const std::vector<bool>& use,
                        const RigParameters& parameters, std::span<const ViewFit> fits,
                        std::vector<Judgement>& judgements, std::stop_token stop) {
  std::vector<bool> logged(use.size()), stand(use.size());
  for (std::size_t i = 0; i < use.size(); ++i) {
    logged[i] = use[i] && rig.views()[i].logged;
    stand[i] = logged[i] && judgements[i].reason.empty();
  }
  const auto count = [](const std::vector<bool>& views) {
    return std::count(views.begin(), views.end(), true);
  };
  const bool most_stand = 2 * count(stand) >= count(logged);
  if (count(logged) == 0 || (most_stand && PooledSigma(fits) < in.scale)) return;
  RefineOptions refine = in.refine;
  if (most_stand) refine.first_window_px = 4 * refine.last_window_px;
  const std::vector<bool>& views = most_stand ? stand : logged;
  const std::string reason =
      RefutedScale(in.mesh, rig, in.photos, views, parameters, refine, std::move(stop));
  if (reason.empty()) return;
  for (std::size_t i = 0; i < judgements.size(); ++i)
    if (logged[i]) judgements[i].reason = reason;
}

struct WithBeads {
  RigAttempt attempt;
  BeadOutcome beads;
};

// `contours`: in.photos, which receive the beads.
Result<WithBeads> SolveRigAndBeads(const Evidence& in, const PhotoSet& photos,
                                   std::span<PhotoContour> contours, const std::vector<bool>& use,
                                   std::vector<bool> known, RigModel rig,
                                   const std::stop_token& stop) {
  std::vector<std::string> names;
  for (const Photo& photo : photos.photos) names.push_back(photo.id);
  const auto attempt_from = [&](const RigModel& start) {
    return SolveWithChanges(
        {in.mesh, contours, names, use, known, in.options.start, in.refine, in.options.changes},
        start, stop);
  };
  const auto with_beads = [&](RigAttempt& attempt) {
    return SolveWithBeads(in.mesh, in.options.bead_findings, in.options.beads, in.refine,
                          ObservabilityFor(attempt.fit), contours, attempt, stop);
  };
  SCAN_TRY(RigAttempt attempt, attempt_from(rig));
  if (in.options.bead_findings.beads.empty()) return WithBeads{std::move(attempt), {}};
  BeadOutcome beads = with_beads(attempt);
  if (!beads.turned && attempt.changes.empty())
    return WithBeads{std::move(attempt), std::move(beads)};
  // What seemed wrong with the rig was told without the beads, of a specimen turned elsewhere.
  for (int m = 0; m < static_cast<int>(rig.mounting_ids().size()); ++m) {
    rig.set_start(m, attempt.rig.TableFromModelOf(attempt.fit.parameters, m));
    known[static_cast<std::size_t>(m)] = true;
  }
  SCAN_TRY(attempt, attempt_from(rig));
  beads = with_beads(attempt);
  return WithBeads{std::move(attempt), std::move(beads)};
}

// The specimen as it stands in the photographs.
struct BentSpecimen {
  std::vector<BentPart> parts;
  TriangleMesh mesh;
  std::optional<ContourMesh> contours;  // of `mesh`; none where nothing was bent
};

// Finds what was bent since the CT and solves again with it bent in the mesh too: left out, it
// would leave the poses to the rest, which knows them less well.
void AllowForBends(const Evidence& in, RigAttempt& attempt, BentSpecimen& specimen,
                   const std::stop_token& stop) {
  constexpr int kBendRounds = 4;
  const BentPartOptions& options = in.options.bent_parts;
  if (std::count(attempt.use.begin(), attempt.use.end(), true) < options.least_views ||
      attempt.distance_px > kExplainedPx * UnitPx(in.refine))
    return;
  RefineResult& fit = attempt.fit;
  RefineOptions again = in.refine;
  again.first_window_px = 2 * in.refine.last_window_px;
  const auto fits_of = [&](const ContourMesh& mesh) {
    return FitViews(mesh, attempt.rig, in.photos, attempt.use, fit.parameters,
                    again.first_window_px, fit.correlation, in.refine);
  };
  specimen.parts = FindBentParts(in.mesh, fits_of(in.mesh), options);
  if (specimen.parts.empty()) return;
  for (int round = 0; round < kBendRounds && !stop.stop_requested(); ++round) {
    if (round > 0)
      RefineBends(*specimen.contours, fits_of(*specimen.contours), options, specimen.parts);
    specimen.mesh = WithBends(in.mesh.mesh, specimen.parts);
    specimen.contours.emplace(specimen.mesh);
    fit = Continued(fit, RefineJoint(*specimen.contours, attempt.rig, in.photos, attempt.use,
                                     fit.parameters, again, stop));
  }
}

// Frees what the photographs show of the cameras, takes out the views that disagree and solves the
// others again, so that nothing of them is spread; then judges every view once more at the pose
// that the others give it.
std::vector<Judgement> Settle(const Evidence& in, RigAttempt& attempt,
                              const std::stop_token& stop) {
  RigModel& rig = attempt.rig;
  RefineResult& fit = attempt.fit;
  RefineOptions again = in.refine;
  again.first_window_px = 2 * in.refine.last_window_px;
  if (FreeWhatIsSeen(rig, PosteriorOf(rig, fit)))
    fit = Continued(fit,
                    RefineJoint(in.mesh, rig, in.photos, attempt.use, fit.parameters, again, stop));
  auto judgements = Judge(in, rig, fit);
  std::vector<bool> agree = attempt.use;
  for (std::size_t i = 0; i < agree.size(); ++i)
    agree[i] = agree[i] && judgements[i].reason.empty();
  // A view without a logged pose rests on its own outline alone: with samples twice as dense the
  // orchid's come nearer to the Cramer-Rao bound by 6 % (924 x 612).
  const bool alone = std::none_of(rig.views().begin(), rig.views().end(),
                                  [](const RigView& view) { return view.logged; });
  if (alone) again.spacing_px = 0.5 * in.refine.spacing_px;
  // One or two of many on one rig could be fitted at any scale, as the specimen's placing is free.
  const auto left = std::count(agree.begin(), agree.end(), true);
  const auto all = std::count(attempt.use.begin(), attempt.use.end(), true);
  const bool enough = left >= 3 || 2 * left >= all || (alone && left > 0);
  if (alone || (enough && agree != attempt.use)) {
    fit = Continued(fit, RefineJoint(in.mesh, rig, in.photos, enough ? agree : attempt.use,
                                     fit.parameters, again, stop));
    judgements = Judge(in, rig, fit);
  }
  RejectRefutedScale(in, rig, attempt.use, fit.parameters, fit.fits, judgements, stop);
  RejectViewsAlone(in, rig, fit.parameters, attempt.changes, judgements);
  return judgements;
}

// Without any logged pose that holds, views could as well be of the mesh's mirror image: rejects
// them where they are. Returns what the report says where the outlines cannot tell.
std::string JudgeMirrorImage(const Evidence& in, const RigAttempt& attempt,
                             std::vector<Judgement>& judgements) {
  const RigModel& rig = attempt.rig;
  const RefineResult& fit = attempt.fit;
  std::vector<PosedView> views;
  for (std::size_t i = 0; i < judgements.size(); ++i) {
    if (!judgements[i].reason.empty()) continue;
    if (rig.views()[i].logged) return {};
    views.push_back(
        {&in.photos[i],
         {rig.CameraFromModelOf(fit.parameters, static_cast<int>(i)),
          rig.IntrinsicsOf(fit.parameters, rig.views()[i].lens), fit.parameters.mask_bias_px}});
  }
  if (views.empty()) return {};
  RefineOptions refine = in.refine;
  refine.correlation_floor_px = fit.correlation.along_px;
  const MirrorComparison comparison = CompareWithMirrorImage(in.mesh, views, refine);
  const std::string reason = MirrorReason(comparison);
  for (Judgement& judgement : judgements)
    if (judgement.reason.empty()) judgement.reason = reason;
  return MirrorNote(comparison);
}

// Everything that the result says of a solve.
Poses Conclude(const Evidence& in, const PhotoSet& photos, std::span<const Mask> masks,
               const RigAttempt& attempt, std::span<const Judgement> judgements) {
  const RigModel& rig = attempt.rig;
  const RefineResult& fit = attempt.fit;
  const ObservabilityOptions observability = ObservabilityFor(fit);
  RigPosterior posterior = PosteriorOf(rig, fit);
  const std::vector<std::string> notes =
      RigNotes(photos, rig, fit.parameters, posterior, attempt.changes, in.mesh.centre);
  const auto free = FreeDirections(in.mesh, rig, fit, judgements, observability);
  for (const FreeDirection& direction : free) AddFreedom(rig, fit.parameters, direction, posterior);
  Poses poses = Describe(in.mesh, photos, masks, rig, fit, posterior, judgements);
  poses.model = in.options.model;
  poses.diagnostics = {fit.steps, in.refine.converged_px, fit.converged,
                       SolveSpectrum(photos, rig, fit),
                       PlacingSpectra(in.mesh, rig, posterior, fit.parameters)};
  poses.free_directions = ByView(photos, free);
  poses.nuisances["residual_sigma_px"].value = PooledSigma(fit.fits);
  poses.nuisances["residual_correlation_px"].value = fit.correlation.along_px;
  poses.nuisances["residual_share_between_views"].value = fit.correlation.between_views;
  if (attempt.reversed) poses.notes.push_back(kReversedNote);
  poses.notes.insert(poses.notes.end(), notes.begin(), notes.end());
  for (const FreeDirection& direction : poses.free_directions)
    poses.notes.push_back(Sentence(direction));
  return poses;
}

// With the poses that `photos` log. Precondition: as CheckPoseInput.
Result<Poses> Solve(const TriangleMesh& mesh, const PhotoSet& photos, std::span<const Mask> masks,
                    const JointOptions& options, const ProgressFn& progress,
                    const std::stop_token& stop) {
  const double scale = photos.intrinsics(photos.photos.front()).w / 1848.0;
  RigModel rig(photos, ScaledTo(options.rig, scale));
  if (!options.bead_findings.beads.empty() &&
      options.bead_findings.images.size() != photos.photos.size())
    return BadInput("the number of lists of bead images is not that of the photographs", "beads",
                    "look for beads in every photograph");
  std::vector<PhotoContour> contours = PhotoContours(masks);
  std::vector<bool> use(contours.size());
  for (std::size_t i = 0; i < use.size(); ++i) use[i] = !contours[i].empty();
  if (std::none_of(use.begin(), use.end(), [](bool u) { return u; }))
    return BadInput("no photograph shows a specimen", "session", "check the masks");

  const ContourMesh contour_mesh(mesh);
  std::vector<bool> known(rig.mounting_ids().size(), false);
  for (std::size_t m = 0; m < known.size(); ++m) {
    const auto placing = options.table_from_model.find(rig.mounting_ids()[m]);
    known[m] = placing != options.table_from_model.end();
    if (known[m]) rig.set_start(static_cast<int>(m), placing->second);
  }
  const Evidence in{contour_mesh, contours, options, ScaledTo(options.refine, scale), scale};
  Report(progress, "poses: search", 0.0);
  const Alternatives alternatives = StartViewsAlone(in, photos, rig, use, known, stop);
  if (stop.stop_requested()) return Cancelled("pose");
  Report(progress, "poses: refine", 0.5);
  SCAN_TRY(WithBeads solved, SolveRigAndBeads(in, photos, contours, use, known, rig, stop));
  auto& [attempt, beads] = solved;
  BentSpecimen bent;
  AllowForBends(in, attempt, bent, stop);
  const Evidence settled{bent.contours ? *bent.contours : contour_mesh, contours, options,
                         in.refine, scale};
  std::vector<Judgement> judgements = Settle(settled, attempt, stop);
  const std::string mirror_note = JudgeMirrorImage(settled, attempt, judgements);
  if (stop.stop_requested()) return Cancelled("pose");
  Report(progress, "poses: uncertainty", 0.9);
  Poses poses = Conclude(settled, photos, masks, attempt, judgements);
  poses.notes.insert(poses.notes.end(), beads.notes.begin(), beads.notes.end());
  if (beads.sightings > 0) poses.nuisances["bead_residual_px"].value = beads.residual_px;
  for (const BentPart& part : bent.parts) poses.notes.push_back(BentPartNote(part));
  if (!mirror_note.empty()) poses.notes.push_back(mirror_note);
  for (std::size_t i = 0; i < alternatives.size(); ++i)
    poses.views[i].alternatives = alternatives[i];
  return poses;
}

int Accepted(const Poses& poses) {
  return static_cast<int>(
      std::count_if(poses.views.begin(), poses.views.end(),
                    [](const ViewPose& view) { return view.status == ViewStatus::accepted; }));
}

// Photographs that were each found alone, solved as one camera's before a turntable where their
// poses say so: views then share what each alone knows less well.
Result<Poses> SolveOnFoundTurntable(const TriangleMesh& mesh, const PhotoSet& photos,
                                    std::span<const Mask> masks, const JointOptions& options,
                                    Poses alone, const ProgressFn& progress,
                                    const std::stop_token& stop) {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    centre += vertex / static_cast<double>(mesh.vertices.size());
  const auto found = FindTurntable(photos, alone, centre);
  if (!found) return alone;
  JointOptions again = options;
  for (const Photo& photo : found->photos.photos)
    again.table_from_model[photo.mounting_id] = found->table_from_model;
  SCAN_TRY(Poses together, Solve(mesh, found->photos, masks, again, progress, stop));
  if (Accepted(together) < Accepted(alone)) return alone;
  together.notes.insert(
      together.notes.begin(),
      fmt::format("The poses of {} of {} views, each found alone, are those of one camera before a "
                  "specimen that turns about one axis: they were solved together as such.",
                  found->views, photos.photos.size()));
  std::copy_if(alone.notes.begin(), alone.notes.end(), std::back_inserter(together.notes),
               IsMirrorNote);
  return together;
}

}  // namespace

Result<Poses> SolveJoint(const TriangleMesh& mesh, const PhotoSet& given,
                         std::span<const Mask> masks, const JointOptions& options,
                         const ProgressFn& progress, std::stop_token stop) {
  SCAN_CHECK(CheckPoseInput(mesh, given, masks));
  const PhotoSet photos = options.no_priors ? WithoutPoses(given) : given;
  SCAN_TRY(Poses poses, Solve(mesh, photos, masks, options, progress, stop));
  const bool logged = std::any_of(
      photos.photos.begin(), photos.photos.end(),
      [&](const Photo& photo) { return NominalCameraFromTable(photos, photo).has_value(); });
  if (logged) return poses;
  return SolveOnFoundTurntable(mesh, photos, masks, options, std::move(poses), progress, stop);
}

}  // namespace scan
