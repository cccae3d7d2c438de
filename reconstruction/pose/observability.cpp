#include "reconstruction/pose/observability.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "reconstruction/pose/rigid_motion.h"

namespace scan {
namespace {

using Row6 = Eigen::Matrix<double, 1, 6>;

// Motion of a body point per body motion about `centre`: w x (p - c) + tau.
Eigen::Matrix<double, 3, 6> MotionOf(const Eigen::Vector3d& point, const Eigen::Vector3d& centre) {
  Eigen::Matrix<double, 3, 6> motion;
  motion << -Skew(point - centre), Eigen::Matrix3d::Identity();
  return motion;
}

// d(pixel)/d(point in the model frame); distortion is of no matter here.
Eigen::Matrix<double, 2, 3> PixelOf(const CameraFromModel& camera_from_model, const Intrinsics& in,
                                    const Eigen::Vector3d& point) {
  const Eigen::Vector3d x = camera_from_model * point;
  Eigen::Matrix<double, 2, 3> d;
  d << in.fl_x / x.z(), 0, -in.fl_x * x.x() / (x.z() * x.z()),  //
      0, in.fl_y / x.z(), -in.fl_y * x.y() / (x.z() * x.z());
  return d * camera_from_model.rotation();
}

// Each vertex's normal is replaced by the mean over its neighbours and itself.
std::vector<Eigen::Vector3d> AveragedOnce(const ContourMesh& mesh,
                                          const std::vector<Eigen::Vector3d>& normals) {
  std::vector<Eigen::Vector3d> sum = normals;
  for (const MeshEdge& edge : mesh.edges.edges) {
    sum[edge.vertices[0]] += normals[edge.vertices[1]];
    sum[edge.vertices[1]] += normals[edge.vertices[0]];
  }
  for (Eigen::Vector3d& n : sum) {
    const double length = n.norm();
    if (length > 1e-9) n /= length;
  }
  return sum;
}

// Mean square motion of the surface in the pictures, px^2, per body motion.
Matrix6d SurfaceMotion(const ContourMesh& mesh, const RigModel& rig,
                       const RigParameters& parameters, std::span<const int> views) {
  Matrix6d sum = Matrix6d::Zero();
  const std::size_t stride = std::max<std::size_t>(1, mesh.mesh.vertices.size() / 1000);
  double count = 0;
  for (const int view : views) {
    const CameraFromModel pose = rig.CameraFromModelOf(parameters, view);
    const Intrinsics in = rig.IntrinsicsOf(parameters, rig.views()[view].lens);
    for (std::size_t i = 0; i < mesh.mesh.vertices.size(); i += stride) {
      const Eigen::Vector3d& p = mesh.mesh.vertices[i];
      const Eigen::Matrix<double, 2, 6> d = PixelOf(pose, in, p) * MotionOf(p, mesh.centre);
      sum += d.transpose() * d;
      count += 1;
    }
  }
  sum /= std::max(1.0, count);
  // Never singular: a body of points on one line does not move when turned about it.
  sum.diagonal() *= 1 + 1e-9;
  return sum;
}

struct Contours {
  Matrix6d information = Matrix6d::Zero();  // of the body motion, mask bias marginalised
  Matrix6d faked = Matrix6d::Zero();        // that normals with noise of 1 rad add to it
};

Contours ContourInformation(const ContourMesh& mesh, const SmoothNormals& smooth,
                            const RigModel& rig, const RefineResult& fit,
                            std::span<const int> views, const ObservabilityOptions& options) {
  using Vector7d = Eigen::Matrix<double, 7, 1>;
  Eigen::Matrix<double, 7, 7> M = Eigen::Matrix<double, 7, 7>::Zero();  // body motion, mask bias
  M(6, 6) = 1 / std::pow(std::max(rig.priors().mask_bias_px, 1e-4), 2);
  Contours contours;
  for (const int view : views) {
    const ViewFit& seen = fit.fits[view];
    const int lens = rig.views()[view].lens;
    const CameraFromModel pose = rig.CameraFromModelOf(fit.parameters, view);
    const Intrinsics in = rig.IntrinsicsOf(fit.parameters, lens);
    EvidenceWeights weights = options.weights;
    weights.sigma_px = seen.sigma_px;
    for (const ContourMatch& match : seen.match.matches) {
      const double w = WeightOf(match, match.residual_px, weights);
      Eigen::Vector3d normal =
          smooth.normals[match.vertices[0]] + smooth.normals[match.vertices[1]];
      if (w <= 0 || normal.norm() < 1e-9) continue;
      normal.normalize();
      const Eigen::Vector3d x = pose * match.point;
      const double px_per_mm = in.fl_x / x.z();
      const Eigen::Matrix<double, 3, 6> motion = px_per_mm * MotionOf(match.point, mesh.centre);
      const Row6 along = normal.transpose() * motion;
      Vector7d row;
      row << along.transpose(), 1;
      M.selfadjointView<Eigen::Lower>().rankUpdate(row, w);
      contours.faked += w * (motion.transpose() * motion - along.transpose() * along);
    }
    for (const BeadSighting& bead : seen.beads) {
      const Eigen::Matrix<double, 2, 6> moved =
          PixelOf(pose, in, bead.centre) * MotionOf(bead.centre, mesh.centre);
      M.topLeftCorner<6, 6>() += moved.transpose() * moved / (bead.sigma_px * bead.sigma_px);
    }
  }
  M.triangularView<Eigen::StrictlyUpper>() = M.transpose();
  contours.information =
      M.topLeftCorner<6, 6>() - M.topRightCorner<6, 1>() * M.bottomLeftCorner<1, 6>() / M(6, 6);
  return contours;
}

Screw ScrewOf(const Vector6d& u, const Eigen::Vector3d& centre) {
  const Eigen::Vector3d w = u.head<3>(), tau = u.tail<3>();
  return {w.normalized(), centre + w.cross(tau) / w.squaredNorm()};
}

// The rotation that slides the surface along itself best (Gelfand and Guibas 2004): found from the
// whole mesh, so more exactly than from the contours.
Screw SlippageAxis(const ContourMesh& mesh, const SmoothNormals& smooth, const Matrix6d& motion) {
  Matrix6d slip = Matrix6d::Zero();
  for (const Face& face : mesh.mesh.faces) {
    const Eigen::Vector3d &a = mesh.mesh.vertices[face[0]], &b = mesh.mesh.vertices[face[1]],
                          &c = mesh.mesh.vertices[face[2]];
    const Eigen::Vector3d normal =
        smooth.normals[face[0]] + smooth.normals[face[1]] + smooth.normals[face[2]];
    if (normal.norm() < 1e-9) continue;
    const double area = 0.5 * (b - a).cross(c - a).norm();
    const Row6 row = normal.normalized().transpose() * MotionOf((a + b + c) / 3.0, mesh.centre);
    slip += area * row.transpose() * row;
  }
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6d> eigen(slip, motion);
  return ScrewOf(eigen.eigenvectors().col(0), mesh.centre);
}

}  // namespace

SmoothNormals SmoothNormalsOf(const ContourMesh& mesh, int rounds) {
  SmoothNormals smooth;
  smooth.normals = mesh.vertex_normals;
  if (smooth.normals.empty()) return smooth;
  for (int round = 0; round < rounds; ++round) smooth.normals = AveragedOnce(mesh, smooth.normals);
  std::vector<double> angle;
  for (std::size_t i = 0; i < smooth.normals.size(); ++i)
    angle.push_back(smooth.normals[i].cross(mesh.vertex_normals[i]).norm());
  const auto middle = angle.begin() + static_cast<std::ptrdiff_t>(angle.size() / 2);
  std::nth_element(angle.begin(), middle, angle.end());
  // Each round averages about seven normals; after some rounds about as many vertices as rounds
  // times six count, so the noise left is the one taken away over the root of that.
  smooth.noise_rad = *middle / std::sqrt(std::max(1.0, 6.0 * rounds));
  return smooth;
}

Screw SlippageAxisOf(const ContourMesh& mesh, const SmoothNormals& smooth, const RigModel& rig,
                     const RigParameters& parameters, std::span<const int> views) {
  return SlippageAxis(mesh, smooth, SurfaceMotion(mesh, rig, parameters, views));
}

std::vector<FreeDirection> FreeDirectionsOf(const ContourMesh& mesh, const SmoothNormals& smooth,
                                            const RigModel& rig, const RefineResult& fit,
                                            std::span<const int> views,
                                            const ObservabilityOptions& options) {
  std::vector<FreeDirection> free;
  if (views.empty()) return free;
  const Matrix6d motion = SurfaceMotion(mesh, rig, fit.parameters, views);
  const Contours contours = ContourInformation(mesh, smooth, rig, fit, views, options);
  const double noise = std::max(smooth.noise_rad, options.normal_noise_rad);
  const Matrix6d information = contours.information - noise * noise * contours.faked;
  // In units of the picture: u' motion u = 1 px^2.
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6d> eigen(information, motion);
  for (int i = 0; i < 6; ++i) {
    const double per_px2 = eigen.eigenvalues()[i];
    if (per_px2 >= 1 / (options.free_px * options.free_px)) break;  // ascending
    const double sigma_px =
        per_px2 > 0 ? 1 / std::sqrt(per_px2) : std::numeric_limits<double>::infinity();
    const Vector6d u = eigen.eigenvectors().col(i);
    FreeDirection direction;
    direction.scope = FreeDirection::Scope::mounting;
    direction.of = rig.mounting_ids()[static_cast<std::size_t>(rig.views()[views[0]].mounting)];
    direction.held_by = "prior";
    if (u.head<3>().norm() * mesh.radius_mm > u.tail<3>().norm()) {
      Screw screw = ScrewOf(u, mesh.centre);
      const Screw whole = SlippageAxis(mesh, smooth, motion);
      if (std::abs(whole.axis.dot(screw.axis)) > std::cos(5 * kPi / 180))
        screw = {whole.axis.dot(screw.axis) < 0 ? Eigen::Vector3d(-whole.axis) : whole.axis,
                 whole.point};
      direction.kind = FreeDirection::Kind::rotation;
      direction.axis = screw.axis;
      direction.point = screw.point;
      direction.data_sigma = sigma_px * u.head<3>().norm();
    } else {
      direction.kind = FreeDirection::Kind::translation;
      direction.axis = u.tail<3>().normalized();
      direction.point = mesh.centre;
      direction.data_sigma = sigma_px * u.tail<3>().norm();
    }
    free.push_back(direction);
  }
  return free;
}

void AddFreedom(const RigModel& rig, const RigParameters& parameters,
                const FreeDirection& direction, RigPosterior& posterior) {
  for (int m = 0; m < static_cast<int>(rig.mounting_ids().size()); ++m) {
    if (rig.mounting_ids()[static_cast<std::size_t>(m)] != direction.of) continue;
    const TableFromModel table_from_model = rig.TableFromModelOf(parameters, m);
    const Eigen::Vector3d axis = table_from_model.rotation() * direction.axis;
    const Eigen::Vector3d point = table_from_model * direction.point;
    const bool turns = direction.kind == FreeDirection::Kind::rotation;
    const double sigma =
        turns ? rig.priors().mounting_rotation_rad : rig.priors().mounting_translation_mm;
    Eigen::VectorXd d = Eigen::VectorXd::Zero(posterior.layout.size);
    if (turns) d.segment<3>(posterior.layout.mounting(m)) = axis;
    d.segment<3>(posterior.layout.mounting(m) + 3) =
        turns ? Eigen::Vector3d(point.cross(axis)) : axis;
    posterior.covariance += sigma * sigma * d * d.transpose();
  }
}

std::string Sentence(const FreeDirection& d) {
  const std::string of = (d.scope == FreeDirection::Scope::view ? "View " : "Mounting ") + d.of;
  const std::string axis =
      fmt::format("({:.3f}, {:.3f}, {:.3f})", d.axis.x(), d.axis.y(), d.axis.z());
  if (d.kind == FreeDirection::Kind::rotation)
    return fmt::format(
        "{}: the silhouettes do not show how far the specimen is turned about the axis {} "
        "through ({:.2f}, {:.2f}, {:.2f}) mm of the model; the angle given is arbitrary. A pin, a "
        "notch "
        "or beads that X-ray and camera both see would fix it.",
        of, axis, d.point.x(), d.point.y(), d.point.z());
  return fmt::format(
      "{}: the silhouettes do not show where the specimen stands along {} of the model; "
      "it is "
      "held at the prior. Photographs from other directions would fix it.",
      of, axis);
}

}  // namespace scan
