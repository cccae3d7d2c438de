#include "reconstruction/pose/rig_solve.h"

#include <ceres/ceres.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <span>

#include "reconstruction/pose/lens_distortion.h"
#include "reconstruction/pose/rig_chain.h"

namespace scan {
namespace {

struct ViewMotion {
  const RigView& view;
  TableFromModel start;
  CameraFromModel from;   // the motion is counted from here
  Eigen::Vector3d pivot;  // camera frame

  template <class T>
  bool operator()(const T* mounting, const T* epoch, const T* aim, const T* axis, const T* lens,
                  const T* own, const T* bias, const T* scale, T* y) const {
    const RigidOf<T> now =
        CameraFromModelChain(view, start, mounting, *epoch, aim, axis, own, *scale);
    const Eigen::Matrix<T, 3, 3> turn = now.rotation * from.rotation().transpose().cast<T>();
    ceres::RotationMatrixToAngleAxis(turn.data(), y);
    const Eigen::Vector3d arm = from.translation() - pivot;
    Eigen::Map<Eigen::Matrix<T, 3, 1>> tau(y + 3);
    tau = now.translation - pivot.cast<T>() - turn * arm.cast<T>();
    for (int i = 0; i < 3; ++i) y[6 + i] = lens[i];
    y[9] = *bias;
    y[10] = lens[3];
    return true;
  }
};

using ViewMotionFunction =
    ceres::AutoDiffCostFunction<ViewMotion, kEvidenceSize, 6, 1, 6, 4, kLensSize, 8, 1, 1>;

// Blocks: mounting, epoch, aim, axis, lens, view, mask bias, CT scale.
constexpr std::array<int, 8> kBlockSizes{6, 1, 6, 4, kLensSize, 8, 1, 1};

// A view's evidence: r = A (y - y0) + b with A' A = H and A' b = g, and for each place whose
// discrepancy d other views see too  sqrt(D) d + (C' (y - y0) + g) / sqrt(D). Such a place is no
// longer minimised over in H and g, and they lose what its own residual says. After the blocks of
// the view's motion one of size 1 for each of those places.
class EvidenceCost final : public ceres::CostFunction {
 public:
  EvidenceCost(const ViewMotion& motion, const EvidenceVector& y0,
               const CondensedEvidence& evidence, std::span<const PlaceEvidence> shared)
      : motion_(new ViewMotion(motion)), y0_(y0) {
    const auto places = static_cast<Eigen::Index>(shared.size());
    A_ = Eigen::MatrixXd::Zero(kEvidenceSize + places, kEvidenceSize);
    b_ = Eigen::VectorXd::Zero(kEvidenceSize + places);
    sqrt_D_ = Eigen::VectorXd::Zero(places);
    EvidenceMatrix H = evidence.H;
    EvidenceVector g = evidence.g;
    for (Eigen::Index k = 0; k < places; ++k) {
      const PlaceEvidence& place = shared[static_cast<std::size_t>(k)];
      const double taken = 1 / (1 + place.D) - 1 / place.D;
      H += taken * place.C * place.C.transpose();
      g += taken * place.g * place.C;
      sqrt_D_[k] = std::sqrt(place.D);
      A_.row(kEvidenceSize + k) = place.C.transpose() / sqrt_D_[k];
      b_[kEvidenceSize + k] = place.g / sqrt_D_[k];
    }
    // Scaled to a unit diagonal first: rad, mm and px differ by orders of magnitude.
    const EvidenceVector scale = H.diagonal().cwiseMax(1e-24).cwiseSqrt().cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<EvidenceMatrix> eigen(scale.asDiagonal() * H *
                                                              scale.asDiagonal());
    const double floor = 1e-13 * std::max(eigen.eigenvalues().maxCoeff(), 1e-300);
    for (int i = 0; i < kEvidenceSize; ++i) {
      const double lambda = eigen.eigenvalues()[i];
      if (lambda <= floor) continue;
      const EvidenceVector v = eigen.eigenvectors().col(i);
      A_.row(i) = std::sqrt(lambda) * v.transpose() * scale.cwiseInverse().asDiagonal();
      b_[i] = v.dot(scale.cwiseProduct(g)) / std::sqrt(lambda);
    }
    set_num_residuals(static_cast<int>(b_.size()));
    auto& sizes = *mutable_parameter_block_sizes();
    sizes.assign(kBlockSizes.begin(), kBlockSizes.end());
    sizes.insert(sizes.end(), shared.size(), 1);
  }

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    constexpr int kMotionSize = std::accumulate(kBlockSizes.begin(), kBlockSizes.end(), 0);
    std::array<double, kEvidenceSize * kMotionSize> storage{};
    std::array<double*, kBlockSizes.size()> dy{};
    for (std::size_t k = 0, offset = 0; k < dy.size(); offset += kBlockSizes[k++])
      dy[k] = storage.data() + kEvidenceSize * offset;
    EvidenceVector y;
    if (!motion_.Evaluate(x, y.data(), jacobians ? dy.data() : nullptr)) return false;
    Eigen::Map<Eigen::VectorXd> r(residuals, b_.size());
    r = A_ * (y - y0_) + b_;
    for (Eigen::Index k = 0; k < sqrt_D_.size(); ++k)
      r[kEvidenceSize + k] += sqrt_D_[k] * *x[kBlockSizes.size() + static_cast<std::size_t>(k)];
    if (!jacobians) return true;
    for (std::size_t k = 0; k < kBlockSizes.size(); ++k) {
      if (!jacobians[k]) continue;
      Eigen::Map<RowMajor>(jacobians[k], b_.size(), kBlockSizes[k]) =
          A_ * Eigen::Map<RowMajor>(dy[k], kEvidenceSize, kBlockSizes[k]);
    }
    for (Eigen::Index k = 0; k < sqrt_D_.size(); ++k) {
      double* column = jacobians[kBlockSizes.size() + static_cast<std::size_t>(k)];
      if (!column) continue;
      std::fill_n(column, b_.size(), 0.0);
      column[kEvidenceSize + k] = sqrt_D_[k];
    }
    return true;
  }

 private:
  ViewMotionFunction motion_;
  EvidenceVector y0_;
  Eigen::MatrixXd A_;
  Eigen::VectorXd b_, sqrt_D_;
};

// Places that several views see, in order, with the number of each.
std::map<SurfacePlace, int> SharedPlaces(
    std::span<const std::optional<CondensedEvidence>> evidence) {
  std::map<SurfacePlace, int> views;
  for (const auto& view : evidence)
    if (view)
      for (const PlaceEvidence& place : view->places) ++views[place.place];
  std::erase_if(views, [](const auto& place) { return place.second < 2; });
  int number = 0;
  for (auto& [place, index] : views) index = number++;
  return views;
}

// (x - 0) / sigma for each component.
class PriorCost final : public ceres::CostFunction {
 public:
  explicit PriorCost(Eigen::VectorXd sigma) : sigma_(std::move(sigma)) {
    set_num_residuals(static_cast<int>(sigma_.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(sigma_.size()));
  }
  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    const Eigen::Index n = sigma_.size();
    Eigen::Map<Eigen::VectorXd>(residuals, n) =
        Eigen::Map<const Eigen::VectorXd>(x[0], n).cwiseQuotient(sigma_);
    if (jacobians && jacobians[0]) {
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
          jacobians[0], n, n) = sigma_.cwiseInverse().asDiagonal();
    }
    return true;
  }

 private:
  Eigen::VectorXd sigma_;
};

// Of the blocks that take part in a view's chain, where they are in the layout.
std::array<int, 8> BlockOffsets(const RigModel& rig, const RigLayout& layout, int view) {
  const RigView& v = rig.views()[view];
  return {
      layout.mounting(v.mounting), layout.epoch(v.epoch), layout.aim(v.aim),  layout.axis(),
      layout.lens(v.lens),         layout.view(view),     layout.mask_bias(), layout.ct_scale()};
}

// Calls visit(offset, block) for every block of the parameters, in the order of the layout.
template <class Parameters, class Visit>
void ForEachBlock(const RigLayout& layout, Parameters& p, Visit&& visit) {
  const auto count = [](const auto& list) { return static_cast<int>(list.size()); };
  for (int i = 0; i < count(p.mountings); ++i) visit(layout.mounting(i), std::span(p.mountings[i]));
  for (int i = 0; i < count(p.epochs); ++i) visit(layout.epoch(i), std::span(&p.epochs[i], 1));
  for (int i = 0; i < count(p.aims); ++i) visit(layout.aim(i), std::span(p.aims[i]));
  visit(layout.axis(), std::span(p.axis));
  for (int i = 0; i < count(p.lenses); ++i) visit(layout.lens(i), std::span(p.lenses[i]));
  visit(layout.mask_bias(), std::span(&p.mask_bias_px, 1));
  visit(layout.ct_scale(), std::span(&p.log_ct_scale, 1));
  for (int i = 0; i < count(p.views); ++i) visit(layout.view(i), std::span(p.views[i]));
}

// One vector: Ceres orders blocks by address, and the solve must not depend on where they happen to
// lie.
Eigen::VectorXd Pack(const RigLayout& layout, const RigParameters& parameters) {
  Eigen::VectorXd x(layout.size);
  ForEachBlock(layout, parameters, [&](int offset, auto block) {
    std::copy(block.begin(), block.end(), x.data() + offset);
  });
  return x;
}

// Log-parameters of the state that the evidence was linearised about.
EvidenceVector EvidenceOrigin(const RigModel& rig, const CondensedEvidence& evidence, int lens) {
  const Intrinsics& nominal = rig.nominal_intrinsics(lens);
  const Intrinsics& in = evidence.state.intrinsics;
  EvidenceVector y0 = EvidenceVector::Zero();
  y0[6] = std::log(in.fl_x / nominal.fl_x);
  y0[7] = in.cx - nominal.cx;
  y0[8] = in.cy - nominal.cy;
  y0[9] = evidence.state.mask_bias_px;
  y0[10] = (in.k1 - nominal.k1) / K1OfCorner(nominal);
  return y0;
}

}  // namespace

RigLayout::RigLayout(const RigModel& rig) {
  epochs_ = 6 * static_cast<int>(rig.mounting_ids().size());
  aims_ = epochs_ + static_cast<int>(rig.epoch_names().size());
  axis_ = aims_ + 6 * static_cast<int>(rig.aim_sigma().size());
  lenses_ = axis_ + 4;
  bias_ = lenses_ + kLensSize * static_cast<int>(rig.lens_sigma().size());
  views_ = bias_ + 2;
  size = views_ + 8 * static_cast<int>(rig.views().size());
}

Eigen::VectorXd PriorSigmas(const RigModel& rig, const RigLayout& layout) {
  // A prior of zero width is a narrow one, so that every direction stays finite: 0.00006 degrees
  // and 10 nm, far below what a photograph shows.
  constexpr double kRotation = 1e-6, kLength = 1e-5;
  const RigPriors& priors = rig.priors();
  Eigen::VectorXd sigma = Eigen::VectorXd::Ones(layout.size);
  const auto rigid = [&](int offset, const RigidSigma& s) {
    sigma.segment<3>(offset).setConstant(std::max(s.rotation_rad, kRotation));
    sigma.segment<3>(offset + 3).setConstant(std::max(s.translation_mm, kLength));
  };
  for (int i = 0; i < static_cast<int>(rig.mounting_ids().size()); ++i)
    rigid(layout.mounting(i), {priors.mounting_rotation_rad, priors.mounting_translation_mm});
  for (int i = 0; i < static_cast<int>(rig.epoch_names().size()); ++i)
    sigma[layout.epoch(i)] = std::max(rig.epoch_sigma_rad(i), kRotation);
  for (int i = 0; i < static_cast<int>(rig.aim_sigma().size()); ++i)
    rigid(layout.aim(i), rig.aim_sigma()[i]);
  sigma.segment<2>(layout.axis()).setConstant(std::max(priors.axis_tilt_rad, kRotation));
  sigma.segment<2>(layout.axis() + 2).setConstant(std::max(priors.axis_shift_mm, kLength));
  for (int i = 0; i < static_cast<int>(rig.lens_sigma().size()); ++i) {
    sigma[layout.lens(i)] = std::max(rig.lens_sigma()[i].fl_rel, 1e-7);
    sigma.segment<2>(layout.lens(i) + 1).setConstant(std::max(rig.lens_sigma()[i].c_px, 1e-3));
    // No format states how well the distortion is known: as the focal length, which the same
    // pictures calibrate. At 1 % of that the corner is off by 0.2 % of its distance from the
    // middle.
    sigma[layout.lens(i) + 3] = std::max(0.2 * rig.lens_sigma()[i].fl_rel, 1e-8);
  }
  sigma[layout.mask_bias()] = std::max(priors.mask_bias_px, 1e-4);
  sigma[layout.ct_scale()] = std::max(priors.ct_scale_rel, 1e-7);
  for (int i = 0; i < static_cast<int>(rig.views().size()); ++i) {
    const RigView& view = rig.views()[i];
    sigma[layout.view(i)] = std::max(view.sigma_turntable_rad, kRotation);
    sigma[layout.view(i) + 1] = std::max(view.sigma_lift_mm, kLength);
    rigid(layout.view(i) + 2, view.sigma_camera);
  }
  return sigma;
}

double SolveRig(const RigModel& rig, std::span<const std::optional<CondensedEvidence>> evidence,
                RigParameters& parameters) {
  const RigLayout layout(rig);
  Eigen::VectorXd sigma = PriorSigmas(rig, layout);
  for (int lens = 0; lens < static_cast<int>(rig.lens_sigma().size()); ++lens)
    for (int k = 0; k < kLensSize; ++k)
      if (rig.held(lens, k)) sigma[layout.lens(lens) + k] = k == 0 || k == 3 ? 1e-9 : 1e-6;
  ceres::Problem problem;
  auto* ordering = new ceres::ParameterBlockOrdering;
  const std::map<SurfacePlace, int> places = SharedPlaces(evidence);
  const auto place_count = static_cast<Eigen::Index>(places.size());
  Eigen::VectorXd x(layout.size + place_count);
  x << Pack(layout, parameters), Eigen::VectorXd::Zero(place_count);
  ForEachBlock(layout, parameters, [&](int offset, auto block) {
    double* at = x.data() + offset;
    const auto size = static_cast<Eigen::Index>(block.size());
    problem.AddResidualBlock(new PriorCost(sigma.segment(offset, size)), nullptr, at);
    ordering->AddElementToGroup(at, offset >= layout.view(0) ? 0 : 1);
  });
  for (Eigen::Index k = 0; k < place_count; ++k) {
    double* at = x.data() + layout.size + k;
    problem.AddResidualBlock(new PriorCost(Eigen::VectorXd::Ones(1)), nullptr, at);
    ordering->AddElementToGroup(at, 1);
  }
  for (int i = 0; i < static_cast<int>(parameters.views.size()); ++i) {
    if (!evidence[i]) continue;
    const RigView& view = rig.views()[i];
    const ViewMotion motion{view, rig.start(view.mounting), evidence[i]->state.camera_from_model,
                            evidence[i]->pivot};
    std::vector<double*> blocks;
    for (const int offset : BlockOffsets(rig, layout, i)) blocks.push_back(x.data() + offset);
    std::vector<PlaceEvidence> shared;
    for (const PlaceEvidence& place : evidence[i]->places) {
      const auto found = places.find(place.place);
      if (found == places.end()) continue;
      shared.push_back(place);
      blocks.push_back(x.data() + layout.size + found->second);
    }
    problem.AddResidualBlock(new EvidenceCost(motion, EvidenceOrigin(rig, *evidence[i], view.lens),
                                              *evidence[i], shared),
                             nullptr, blocks);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.linear_solver_ordering.reset(ordering);
  options.num_threads = 1;
  options.max_num_iterations = 20;
  options.function_tolerance = 1e-10;
  options.parameter_tolerance = 1e-12;
  options.gradient_tolerance = 1e-12;
  // Parameters span orders of magnitude; Ceres' own column scaling takes care of it.
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  ForEachBlock(layout, parameters, [&](int offset, auto block) {
    std::copy_n(x.data() + offset, block.size(), block.begin());
  });
  return summary.final_cost;
}

Eigen::MatrixXd ViewJacobian(const RigModel& rig, const RigLayout& layout,
                             const RigParameters& parameters, int view,
                             const Eigen::Vector3d& pivot) {
  const RigView& v = rig.views()[view];
  const ViewMotionFunction function(
      new ViewMotion{v, rig.start(v.mounting), rig.CameraFromModelOf(parameters, view), pivot});
  const Eigen::VectorXd x = Pack(layout, parameters);
  const auto offsets = BlockOffsets(rig, layout, view);
  std::array<const double*, 8> blocks{};
  std::array<std::vector<double>, 8> storage;
  std::array<double*, 8> jacobians{};
  for (int i = 0; i < 8; ++i) {
    blocks[i] = x.data() + offsets[i];
    storage[i].resize(static_cast<std::size_t>(kEvidenceSize * kBlockSizes[i]));
    jacobians[i] = storage[i].data();
  }
  EvidenceVector y;
  function.Evaluate(blocks.data(), y.data(), jacobians.data());
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(kEvidenceSize, layout.size);
  for (int i = 0; i < 8; ++i) {
    J.middleCols(offsets[i], kBlockSizes[i]) =
        Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
            jacobians[i], kEvidenceSize, kBlockSizes[i]);
  }
  return J;
}

Eigen::MatrixXd RigInformation(const RigModel& rig, const RigLayout& layout,
                               std::span<const std::optional<CondensedEvidence>> evidence,
                               const RigParameters& parameters) {
  Eigen::MatrixXd information = PriorSigmas(rig, layout).cwiseAbs2().cwiseInverse().asDiagonal();
  struct Seen {
    Eigen::VectorXd C;
    double D = 0;
  };
  const std::map<SurfacePlace, int> places = SharedPlaces(evidence);
  std::vector<Seen> seen(places.size(), {Eigen::VectorXd::Zero(layout.size), 0});
  for (int i = 0; i < static_cast<int>(rig.views().size()); ++i) {
    if (!evidence[i]) continue;
    const Eigen::MatrixXd J = ViewJacobian(rig, layout, parameters, i, evidence[i]->pivot);
    EvidenceMatrix H = evidence[i]->H;
    for (const PlaceEvidence& place : evidence[i]->places) {
      const auto found = places.find(place.place);
      if (found == places.end()) continue;
      H += place.C * place.C.transpose() / (1 + place.D);
      Seen& sum = seen[static_cast<std::size_t>(found->second)];
      sum.C += J.transpose() * place.C;
      sum.D += place.D;
    }
    information += J.transpose() * H * J;
  }
  // The discrepancies minimised over.
  for (const Seen& place : seen)
    information.noalias() -= place.C * place.C.transpose() / (1 + place.D);
  return information;
}

}  // namespace scan
