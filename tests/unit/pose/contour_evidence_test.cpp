#include "reconstruction/pose/contour_evidence.h"

#include <gtest/gtest.h>

#include "drivers/base/units.h"
#include "pose_scene.h"
#include "reconstruction/pose/lens_distortion.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan {
namespace {

ViewState SomeState() {
  ViewState state;
  state.camera_from_model = CameraFromModel(ExpSo3({0.3, -1.1, 0.7}), Eigen::Vector3d(4, -7, 520));
  state.intrinsics = {1848, 1224, 5480, 5470, 930, 600, 0.05, -0.02, 0.001, -0.002, 0.01};
  state.mask_bias_px = 0.4;
  return state;
}

// The state after a small change of what a residual depends on.
ViewState Changed(ViewState state, const EvidenceVector& y, const Eigen::Vector3d& pivot) {
  state.camera_from_model = MovedAbout(state.camera_from_model, Vector6d(y.head<6>()), pivot);
  state.intrinsics.k1 += y[10] * K1OfCorner(state.intrinsics);
  state.intrinsics.fl_x *= std::exp(y[6]);
  state.intrinsics.fl_y *= std::exp(y[6]);
  state.intrinsics.cx += y[7];
  state.intrinsics.cy += y[8];
  state.mask_bias_px += y[9];
  return state;
}

TEST(ContourResidual, DerivativeAgreesWithDifferences) {
  const ViewState state = SomeState();
  const Eigen::Vector3d point(8, -5, 6), pivot = state.camera_from_model * Eigen::Vector3d(1, 2, 3);
  const Eigen::Vector2d target(900, 640), normal = Eigen::Vector2d(0.6, -0.8);
  EvidenceVector analytic;
  ContourResidual(state, point, target, normal, pivot, &analytic);
  for (int k = 0; k < kEvidenceSize; ++k) {
    const double h = k < 3 || k == 6 || k == 10 ? 1e-6 : 1e-3;
    const EvidenceVector step = h * EvidenceVector::Unit(k);
    const double up =
        ContourResidual(Changed(state, step, pivot), point, target, normal, pivot, nullptr);
    const double down =
        ContourResidual(Changed(state, -step, pivot), point, target, normal, pivot, nullptr);
    EXPECT_NEAR(analytic[k], (up - down) / (2 * h), 1e-5 * (1 + std::abs(analytic[k]))) << k;
  }
}

TEST(MatchContour, FindsTheBiasOfTheMaskAndTheShiftOfThePicture) {
  const TriangleMesh mesh = test::BugMesh(3);
  const ContourMesh contour_mesh(mesh);
  ViewState state = test::BugView();
  const PhotoContour photo =
      MakePhotoContour(test::RenderMask(mesh, state.camera_from_model, state.intrinsics));
  state.intrinsics.cx += 3;  // the model's picture lies 3 px to the right of the photo's
  const auto samples =
      FindContourSamples(contour_mesh, state.camera_from_model, state.intrinsics, 2);
  const MatchResult match = MatchContour(samples, photo, 0.0, 12);
  ASSERT_GT(match.matches.size(), 100u);
  double error = 0;
  for (const ContourMatch& m : match.matches) error += std::abs(m.residual_px + 3 * m.normal.x());
  EXPECT_LT(error / static_cast<double>(match.matches.size()), 0.3);
}

TEST(MatchContour, TheFarSideOfAThinLegIsNoPartner) {
  // A strip 4 px wide; a sample on its left edge, moved 3 px to the right, must find the left edge.
  Mask mask;
  mask.coverage = cv::Mat(60, 60, CV_8U, cv::Scalar(0));
  mask.coverage(cv::Rect(28, 5, 4, 50)) = cv::Scalar(255);
  const PhotoContour photo = MakePhotoContour(mask);
  const ContourSample sample{Eigen::Vector3d::Zero(), {31, 30}, {-1, 0}, {0, 1}, 2};
  const MatchResult match = MatchContour(std::span(&sample, 1), photo, 0, 10);
  ASSERT_EQ(match.matches.size(), 1u);
  EXPECT_NEAR(match.matches[0].target.x(), 28, 0.51);
  EXPECT_NEAR(match.matches[0].residual_px, 3, 0.51);
}

// H and g of residuals r = J y + r0 whose covariance is the inverse weights and, at each place, one
// discrepancy for all: by the whole covariance.
TEST(Condense, TakesTheDiscrepancyOfAPlaceOnce) {
  const ViewState state = SomeState();
  const Eigen::Vector3d pivot = state.camera_from_model * Eigen::Vector3d::Zero();
  std::vector<ContourMatch> matches;
  for (int i = 0; i < 40; ++i) {
    ContourMatch m;
    m.point = {std::sin(i), std::cos(2 * i), 0.1 * i};
    m.normal = Eigen::Vector2d(std::cos(0.3 * i), std::sin(0.3 * i));
    m.target = state.intrinsics.fl_x / 520 * (state.camera_from_model * m.point).head<2>() +
               Eigen::Vector2d(930, 600) + 0.4 * m.normal;
    m.share_px = 4;
    matches.push_back(m);
  }
  EvidenceWeights weights;
  weights.sigma_px = 0.7;
  weights.tukey_sigmas = 1e6;  // least squares
  weights.discrepancy_px = 0.5;
  weights.place_mm = 4;
  const CondensedEvidence evidence = Condense(state, matches, pivot, weights);

  const auto n = static_cast<Eigen::Index>(matches.size());
  Eigen::MatrixXd J(n, kEvidenceSize), covariance = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd r(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const ContourMatch& a = matches[static_cast<std::size_t>(i)];
    EvidenceVector dr;
    r[i] = ContourResidual(state, a.point, a.target, a.normal, pivot, &dr);
    J.row(i) = dr;
    covariance(i, i) = 1 / WeightOf(a, r[i], weights);
    for (Eigen::Index k = 0; k < n; ++k)
      if (PlaceOf(state, a, weights.place_mm) ==
          PlaceOf(state, matches[static_cast<std::size_t>(k)], weights.place_mm))
        covariance(i, k) += 0.25;
  }
  const EvidenceMatrix H = J.transpose() * covariance.llt().solve(J);
  const EvidenceVector g = J.transpose() * covariance.llt().solve(r);
  EXPECT_GT(evidence.places.size(), 4u);
  EXPECT_LT(evidence.places.size(), 30u);
  const EvidenceVector unit = H.diagonal().cwiseSqrt().cwiseInverse();
  EXPECT_LT((unit.asDiagonal() * (evidence.H - H) * unit.asDiagonal()).norm(), 1e-9);
  EXPECT_LT((unit.asDiagonal() * (evidence.g - g)).norm(), 1e-9);
}

double ShareLookedAt(const TriangleMesh& mesh) {
  const ContourMesh contour_mesh(mesh);
  const ViewState state = test::BugView();
  double looked_at = 0;
  for (const ContourCluster& cluster : contour_mesh.clusters.clusters)
    if (!TurnsOneSide(cluster, state.camera_from_model, state.intrinsics,
                      CameraCentre(state.camera_from_model)))
      looked_at += cluster.edge_count;
  return looked_at / static_cast<double>(contour_mesh.edges.edges.size());
}

// Clusters of a closed mesh that turn one side to the camera are passed over: nothing else may
// follow from it than from the same mesh with faces that run either way, where fewer are.
TEST(FindContourSamples, AClosedMeshIsSeenAsAnyOther) {
  const TriangleMesh mesh = test::BugMesh(3);
  TriangleMesh jumbled = mesh;
  for (std::size_t f = 0; f < jumbled.faces.size(); f += 2)
    std::swap(jumbled.faces[f][1], jumbled.faces[f][2]);
  const ViewState state = test::BugView();
  const auto samples = [&](const TriangleMesh& of) {
    return FindContourSamples(ContourMesh(of), state.camera_from_model, state.intrinsics, 2);
  };
  const auto closed = samples(mesh), open = samples(jumbled);
  ASSERT_EQ(closed.size(), open.size());
  ASSERT_GT(closed.size(), 100u);
  for (std::size_t i = 0; i < closed.size(); ++i) EXPECT_EQ(closed[i].pixel, open[i].pixel);
  EXPECT_LT(ShareLookedAt(mesh), 0.6);
  EXPECT_GT(ShareLookedAt(jumbled), 1.2 * ShareLookedAt(mesh));
}

TEST(ContourMesh, KnowsWhetherItIsClosed) {
  TriangleMesh mesh = test::BugMesh(0);
  EXPECT_TRUE(ContourMesh(mesh).closed);
  std::swap(mesh.faces[3][0], mesh.faces[3][1]);
  EXPECT_FALSE(ContourMesh(mesh).closed);
  mesh.faces.erase(mesh.faces.begin() + 3);
  EXPECT_FALSE(ContourMesh(mesh).closed);
}

}  // namespace
}  // namespace scan
