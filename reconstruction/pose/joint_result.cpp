#include "reconstruction/pose/joint_result.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "reconstruction/pose/lens_distortion.h"
#include "reconstruction/render/rasterise.h"

namespace scan {
namespace {

SharedEstimate EstimateAt(const RigPosterior& posterior, int index, double value) {
  return {value, std::sqrt(posterior.covariance(index, index)), posterior.prior_sigma[index]};
}

}  // namespace

RigPosterior PosteriorOf(const RigModel& rig, const RefineResult& fit) {
  RigPosterior posterior{RigLayout(rig), {}, {}};
  posterior.prior_sigma = PriorSigmas(rig, posterior.layout);
  std::vector<std::optional<CondensedEvidence>> evidence;
  for (const ViewFit& view : fit.fits) evidence.push_back(view.evidence);
  const Eigen::MatrixXd information =
      RigInformation(rig, posterior.layout, evidence, fit.parameters);
  // In units of the priors' sigma: mm, rad and px differ by orders of magnitude.
  const auto scale = posterior.prior_sigma.asDiagonal();
  const Eigen::MatrixXd scaled = scale * information * scale;
  const Eigen::Index n = scaled.rows();
  posterior.covariance = scale * scaled.llt().solve(Eigen::MatrixXd::Identity(n, n)) * scale;
  return posterior;
}

EvidenceMatrix ViewCovariance(const RigModel& rig, const RigPosterior& posterior,
                              const RigParameters& parameters, int view) {
  const Eigen::MatrixXd J =
      ViewJacobian(rig, posterior.layout, parameters, view, Eigen::Vector3d::Zero());
  const EvidenceMatrix covariance = J * posterior.covariance * J.transpose();
  return 0.5 * (covariance + covariance.transpose());
}

SurfaceSigma SurfaceSigmaOf(const ContourMesh& mesh, const CameraFromModel& camera_from_model,
                            const Intrinsics& intrinsics, const EvidenceMatrix& covariance) {
  constexpr int kSide = 240;  // of the picture that tells which points are visible
  const double scale = static_cast<double>(kSide) / std::max(intrinsics.w, intrinsics.h);
  const Intrinsics small = Scaled(intrinsics, std::max(1, static_cast<int>(scale * intrinsics.w)),
                                  std::max(1, static_cast<int>(scale * intrinsics.h)));
  const Raster raster = Rasterise(mesh.mesh, camera_from_model, small);
  std::vector<double> sigma;
  const ViewState state{camera_from_model, intrinsics, 0};
  for (int y = 0; y < raster.face.rows; y += 2) {
    for (int x = y / 2 % 2; x < raster.face.cols; x += 2) {
      const std::int32_t id = raster.face.at<std::int32_t>(y, x);
      if (id < 0) continue;
      const Face& face = mesh.mesh.faces[static_cast<std::size_t>(id)];
      const Eigen::Vector3d point = (mesh.mesh.vertices[face[0]] + mesh.mesh.vertices[face[1]] +
                                     mesh.mesh.vertices[face[2]]) /
                                    3.0;
      double variance = 0;
      for (const Eigen::Vector2d& direction : {Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1)}) {
        EvidenceVector dr;
        ContourResidual(state, point, Eigen::Vector2d::Zero(), direction, Eigen::Vector3d::Zero(),
                        &dr);
        dr[9] = 0;  // the mask bias moves no surface
        variance += dr.dot(covariance * dr);
      }
      sigma.push_back(std::sqrt(std::max(0.0, variance)));
    }
  }
  SurfaceSigma result;
  if (sigma.empty()) return result;
  std::sort(sigma.begin(), sigma.end());
  result.median = sigma[sigma.size() / 2];
  result.p95 = sigma[sigma.size() * 95 / 100];
  return result;
}

void DescribeShared(const PhotoSet& photos, const RigModel& rig, const RigPosterior& posterior,
                    const RigParameters& parameters, Poses& poses) {
  const RigLayout& layout = posterior.layout;
  for (std::size_t i = 0; i < photos.lens_states.size(); ++i) {
    const int lens = static_cast<int>(i);
    LensEstimate& estimate = poses.lens_states[photos.lens_states[i].id];
    estimate.intrinsics = rig.IntrinsicsOf(parameters, lens);
    const Intrinsics& nominal = rig.nominal_intrinsics(lens);
    estimate.parameters["fl_rel"] =
        EstimateAt(posterior, layout.lens(lens), parameters.lenses[i][0]);
    SharedEstimate cx = EstimateAt(posterior, layout.lens(lens) + 1, 0);
    cx.value = nominal.cx + parameters.lenses[i][1];
    estimate.parameters["cx"] = cx;
    SharedEstimate cy = EstimateAt(posterior, layout.lens(lens) + 2, 0);
    cy.value = nominal.cy + parameters.lenses[i][2];
    estimate.parameters["cy"] = cy;
    SharedEstimate k1 = EstimateAt(posterior, layout.lens(lens) + 3, 0);
    k1.value = estimate.intrinsics.k1;
    k1.sigma *= K1OfCorner(nominal);
    k1.prior_sigma *= K1OfCorner(nominal);
    estimate.parameters["k1"] = k1;
  }
  poses.nuisances["mask_bias_px"] =
      EstimateAt(posterior, layout.mask_bias(), parameters.mask_bias_px);
  poses.nuisances["ct_scale"] = EstimateAt(posterior, layout.ct_scale(), 0);
  poses.nuisances["ct_scale"].value = std::exp(parameters.log_ct_scale);
  const char* axis_names[] = {"axis_tilt_x_rad", "axis_tilt_y_rad", "axis_shift_x_mm",
                              "axis_shift_y_mm"};
  for (int k = 0; k < 4; ++k)
    poses.nuisances[axis_names[k]] = EstimateAt(posterior, layout.axis() + k, parameters.axis[k]);
  for (std::size_t i = 0; i < rig.epoch_names().size(); ++i) {
    poses.nuisances[fmt::format("turntable_offset_rad_epoch_{}", rig.epoch_names()[i])] =
        EstimateAt(posterior, layout.epoch(static_cast<int>(i)), parameters.epochs[i]);
  }
  for (std::size_t i = 0; i < rig.mounting_ids().size(); ++i) {
    if (RigModel::IsViewMounting(rig.mounting_ids()[i])) continue;
    poses.mountings.push_back(
        {rig.mounting_ids()[i], rig.TableFromModelOf(parameters, static_cast<int>(i))});
  }
  RigParameters shared_only = parameters;
  for (auto& own : shared_only.views) own.fill(0);
  for (std::size_t i = 0; i < rig.views().size(); ++i) {
    const RigView& view = rig.views()[i];
    const std::string& aim = photos.aims[view.aim].id;
    if (!view.turns || poses.axis_in_camera.contains(aim)) continue;
    const CameraFromTable camera_from_table =
        rig.CameraFromTableOf(shared_only, static_cast<int>(i));
    poses.axis_in_camera[aim] = {camera_from_table.rotation().col(2),
                                 camera_from_table.translation()};
  }
}

}  // namespace scan
