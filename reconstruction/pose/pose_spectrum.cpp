#include "reconstruction/pose/pose_spectrum.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "reconstruction/pose/rigid_motion.h"

namespace scan {
namespace {

constexpr std::array<const char*, 6> kMotions{"turn x",  "turn y",  "turn z",
                                              "shift x", "shift y", "shift z"};

}  // namespace

std::vector<std::string> ParameterNames(const PhotoSet& photos, const RigModel& rig,
                                        const RigLayout& layout) {
  std::vector<std::string> names(static_cast<std::size_t>(layout.size));
  const auto rigid = [&names](int offset, const std::string& of) {
    for (std::size_t k = 0; k < kMotions.size(); ++k)
      names[static_cast<std::size_t>(offset) + k] = fmt::format("{} {}", of, kMotions[k]);
  };
  const auto set = [&names](int offset, std::string name) {
    names[static_cast<std::size_t>(offset)] = std::move(name);
  };
  const auto& mountings = rig.mounting_ids();
  for (std::size_t i = 0; i < mountings.size(); ++i) {
    const bool view = RigModel::IsViewMounting(mountings[i]);
    rigid(layout.mounting(static_cast<int>(i)), (view ? "view" : "mounting ") + mountings[i]);
  }
  for (std::size_t i = 0; i < rig.epoch_names().size(); ++i)
    set(layout.epoch(static_cast<int>(i)), "turntable offset, epoch " + rig.epoch_names()[i]);
  for (std::size_t i = 0; i < photos.aims.size(); ++i)
    rigid(layout.aim(static_cast<int>(i)), "aim " + photos.aims[i].id);
  for (int k = 0; k < 4; ++k)
    set(layout.axis() + k, fmt::format("axis {} {}", k < 2 ? "tilt" : "shift", "xy"[k % 2]));
  for (std::size_t i = 0; i < photos.lens_states.size(); ++i) {
    const int at = layout.lens(static_cast<int>(i));
    const std::string of = "lens " + photos.lens_states[i].id;
    set(at, of + " focal length");
    set(at + 1, of + " cx");
    set(at + 2, of + " cy");
    set(at + 3, of + " distortion");
  }
  set(layout.mask_bias(), "mask bias");
  set(layout.ct_scale(), "CT scale");
  for (std::size_t i = 0; i < photos.photos.size(); ++i) {
    const int at = layout.view(static_cast<int>(i));
    const std::string& of = photos.photos[i].name;
    set(at, of + " turntable");
    set(at + 1, of + " lift");
    rigid(at + 2, of + " camera");
  }
  return names;
}

Spectrum SpectrumOf(const std::string& of, const Eigen::MatrixXd& information,
                    const std::vector<std::string>& names) {
  assert(static_cast<std::size_t>(information.rows()) == names.size());
  Spectrum spectrum{of, {}};
  if (information.size() == 0 || !information.allFinite()) return spectrum;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
      0.5 * (information + information.transpose()));
  if (eigen.info() != Eigen::Success) return spectrum;
  for (Eigen::Index i = 0; i < information.rows(); ++i) {
    Eigen::Index largest = 0;
    const double share = eigen.eigenvectors().col(i).cwiseAbs2().maxCoeff(&largest);
    spectrum.lines.push_back(
        {eigen.eigenvalues()[i], names[static_cast<std::size_t>(largest)], share});
  }
  return spectrum;
}

Spectrum SolveSpectrum(const PhotoSet& photos, const RigModel& rig, const RefineResult& fit) {
  constexpr int kMostParameters = 600;
  const RigLayout layout(rig);
  if (layout.size > kMostParameters) return {"solve", {}};
  std::vector<std::optional<CondensedEvidence>> evidence;
  for (const ViewFit& view : fit.fits) evidence.push_back(view.evidence);
  const auto scale = PriorSigmas(rig, layout).eval();
  const Eigen::MatrixXd information = RigInformation(rig, layout, evidence, fit.parameters);
  return SpectrumOf("solve", scale.asDiagonal() * information * scale.asDiagonal(),
                    ParameterNames(photos, rig, layout));
}

std::vector<Spectrum> PlacingSpectra(const ContourMesh& mesh, const RigModel& rig,
                                     const RigPosterior& posterior,
                                     const RigParameters& parameters) {
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  std::vector<Spectrum> spectra;
  for (std::size_t i = 0; i < rig.mounting_ids().size(); ++i) {
    if (RigModel::IsViewMounting(rig.mounting_ids()[i])) continue;
    const int mounting = static_cast<int>(i);
    // (w, rho) about the table's origin to (radius w, rho + w x c) about the specimen's centre c.
    const Eigen::Vector3d centre = rig.TableFromModelOf(parameters, mounting) * mesh.centre;
    Matrix6 about_centre = Matrix6::Identity();
    about_centre.topLeftCorner<3, 3>() *= mesh.radius_mm;
    about_centre.bottomLeftCorner<3, 3>() = -Skew(centre);
    const int at = posterior.layout.mounting(mounting);
    const Matrix6 covariance =
        about_centre * posterior.covariance.block<6, 6>(at, at) * about_centre.transpose();
    const Matrix6 information = covariance.llt().solve(Matrix6::Identity());
    spectra.push_back(
        SpectrumOf(rig.mounting_ids()[i], information, {kMotions.begin(), kMotions.end()}));
  }
  return spectra;
}

}  // namespace scan
