#include "reconstruction/pose/contour_evidence.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "reconstruction/pose/lens_distortion.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan {
namespace {

constexpr double kMinCosine = 0.5;  // normals within 60 degrees

double TukeyWeight(double r, double limit) {
  const double u = r / limit;
  if (std::abs(u) >= 1) return 0;
  return (1 - u * u) * (1 - u * u);
}

bool Ignored(const cv::Mat& ignore, const Eigen::Vector2d& pixel) {
  if (ignore.empty()) return false;
  const int x = static_cast<int>(std::floor(pixel.x())),
            y = static_cast<int>(std::floor(pixel.y()));
  return x >= 0 && y >= 0 && x < ignore.cols && y < ignore.rows && ignore.at<uchar>(y, x) != 0;
}

// Half of the way to either neighbour along the photo's contour, at most the sample's own length to
// each side: weighted so, heaps of samples count no more than single ones, and poses come within a
// few percent of the Cramer-Rao bound (by the samples' own lengths: 10 to 25 %; at most half of it
// to each side: 0 to 5 % more of the centre's error).
void ShareOut(std::vector<ContourMatch>& matches) {
  std::vector<std::size_t> order(matches.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(matches[a].arc_px, a) < std::pair(matches[b].arc_px, b);
  });
  for (std::size_t k = 0; k < order.size(); ++k) {
    ContourMatch& match = matches[order[k]];
    double before = match.length_px, after = match.length_px;
    if (k > 0) before = std::min(before, 0.5 * (match.arc_px - matches[order[k - 1]].arc_px));
    if (k + 1 < order.size())
      after = std::min(after, 0.5 * (matches[order[k + 1]].arc_px - match.arc_px));
    match.share_px = before + after;
  }
}

}  // namespace

PhotoContour MakePhotoContour(const Mask& mask) {
  PhotoContour photo;
  photo.binary = mask.binary;
  std::vector<GridSegment> segments;
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  Eigen::AlignedBox2d box;
  photo.ignore = mask.ignore;
  constexpr double kBetweenContours = 1e5;  // px, so that nothing hangs together across
  double arc_px = 0;
  for (const Contour& contour : ExtractContours(mask)) {
    arc_px += kBetweenContours;
    const std::size_t n = contour.points.size();
    for (std::size_t i = 0; i < n; ++i) {
      const ContourPoint& p = contour.points[i];
      const ContourPoint& q = contour.points[(i + 1) % n];
      const double twice = p.position.x() * q.position.y() - q.position.x() * p.position.y();
      photo.area_px += 0.5 * twice;
      moment += twice / 6.0 * (p.position + q.position);
      box.extend(p.position);
      photo.touches_border |= (p.flags & kContourCut) != 0;
      const double start_px = arc_px;
      arc_px += (q.position - p.position).norm();
      const Eigen::Vector2d normal = p.normal + q.normal;
      const double norm = normal.norm();
      if (norm < 1e-6) continue;
      segments.push_back(
          {p.position, q.position, normal / norm, static_cast<std::uint8_t>(p.flags | q.flags)});
      photo.arc_px.push_back(start_px);
    }
    for (const ContourPoint& p : Resampled(contour, 2.0).points) {
      if (p.flags == 0) photo.points.push_back(p);
    }
  }
  photo.length_px = 2.0 * static_cast<double>(photo.points.size());
  if (photo.area_px > 0) photo.centroid = moment / photo.area_px;
  if (!box.isEmpty()) photo.diameter_px = box.diagonal().norm();
  photo.grid = ContourGrid(std::move(segments), mask.coverage.cols, mask.coverage.rows);
  return photo;
}

double ContourResidual(const ViewState& state, const Eigen::Vector3d& point,
                       const Eigen::Vector2d& target, const Eigen::Vector2d& normal,
                       const Eigen::Vector3d& pivot, EvidenceVector* dr) {
  const Intrinsics& in = state.intrinsics;
  const Eigen::Vector3d x = state.camera_from_model * point;
  const double inverse_z = 1.0 / x.z();
  Eigen::Matrix2d ddistorted_dnormalised;
  const Eigen::Vector2d distorted = Distort(in, x.head<2>() * inverse_z, &ddistorted_dnormalised);
  const Eigen::Vector2d focal(in.fl_x, in.fl_y), centre(in.cx, in.cy);
  const Eigen::Vector2d pixel = focal.cwiseProduct(distorted) + centre;
  if (dr) {
    Eigen::Matrix<double, 2, 3> dnormalised_dx;
    dnormalised_dx << inverse_z, 0, -x.x() * inverse_z * inverse_z,  //
        0, inverse_z, -x.y() * inverse_z * inverse_z;
    const Eigen::RowVector3d dr_dx =
        -normal.transpose() * focal.asDiagonal() * ddistorted_dnormalised * dnormalised_dx;
    dr->head<3>() = -(dr_dx * Skew(x - pivot)).transpose();  // dx/dw = -[x - pivot]
    dr->segment<3>(3) = dr_dx.transpose();
    (*dr)[6] = -normal.dot(pixel - centre);
    dr->segment<2>(7) = -normal;
    (*dr)[9] = -1;
    const Eigen::Vector2d normalised = x.head<2>() * inverse_z;
    (*dr)[10] =
        -K1OfCorner(in) * normalised.squaredNorm() * normal.dot(focal.cwiseProduct(normalised));
  }
  return normal.dot(target - pixel) - state.mask_bias_px;
}

double MatchResult::MatchedLength() const {
  double length = 0;
  for (const ContourMatch& match : matches) length += match.length_px;
  return length;
}

MatchResult MatchContour(std::span<const ContourSample> samples, const PhotoContour& photo,
                         double mask_bias_px, double window_px) {
  MatchResult result;
  result.matches.reserve(samples.size());
  for (const ContourSample& sample : samples) {
    const Eigen::Vector2d from = sample.pixel + mask_bias_px * sample.normal;
    const auto crossing = photo.grid.Nearest(from, sample.normal, window_px, kMinCosine);
    if (!crossing) {
      if (!Ignored(photo.ignore, sample.pixel)) result.unmatched_px += sample.length_px;
      continue;
    }
    const GridSegment& segment = photo.grid.segments()[crossing->segment];
    if (segment.flags != 0) continue;
    const Eigen::Vector2d target = from + crossing->distance_px * sample.normal;
    result.matches.push_back({sample.point, target, sample.normal, crossing->distance_px,
                              sample.length_px, sample.vertices,
                              photo.arc_px[crossing->segment] + (target - segment.a).norm(), 0});
  }
  ShareOut(result.matches);
  return result;
}

double RobustSigma(std::span<const ContourMatch> matches) {
  if (matches.empty()) return 0;
  std::vector<double> magnitude;
  magnitude.reserve(matches.size());
  for (const ContourMatch& match : matches) magnitude.push_back(std::abs(match.residual_px));
  const auto middle = magnitude.begin() + static_cast<std::ptrdiff_t>(magnitude.size() / 2);
  std::nth_element(magnitude.begin(), middle, magnitude.end());
  return 1.4826 * *middle;
}

SurfacePlace PlaceOf(const ViewState& state, const ContourMatch& match, double place_mm) {
  // The surface is tangent to the plane through the camera's centre and the outline.
  const Intrinsics& in = state.intrinsics;
  const Eigen::Vector3d x = state.camera_from_model * match.point;
  const Eigen::Vector2d n(match.normal.x() * in.fl_x, match.normal.y() * in.fl_y);
  const Eigen::Vector3d normal = state.camera_from_model.rotation().transpose() *
                                 Eigen::Vector3d(n.x(), n.y(), -n.dot(x.head<2>()) / x.z());
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  SurfacePlace place{};
  for (int k = 0; k < 3; ++k)
    place[static_cast<std::size_t>(k)] = static_cast<int>(std::floor(match.point[k] / place_mm));
  place[3] = static_cast<int>(2 * axis + (normal[axis] < 0 ? 1 : 0));
  return place;
}

double WeightOf(const ContourMatch& match, double residual_px, const EvidenceWeights& weights) {
  return std::min(1.0, match.share_px / weights.correlation_px) *
         TukeyWeight(residual_px, weights.tukey_sigmas * weights.sigma_px) /
         (weights.sigma_px * weights.sigma_px);
}

CondensedEvidence Condense(const ViewState& state, std::span<const ContourMatch> matches,
                           const Eigen::Vector3d& pivot, const EvidenceWeights& weights) {
  CondensedEvidence evidence;
  evidence.state = state;
  evidence.pivot = pivot;
  const double s = weights.discrepancy_px;
  std::map<SurfacePlace, PlaceEvidence> places;
  for (const ContourMatch& match : matches) {
    EvidenceVector dr;
    const double r = ContourResidual(state, match.point, match.target, match.normal, pivot, &dr);
    const double weight = WeightOf(match, r, weights);
    if (weight <= 0) continue;
    evidence.H.selfadjointView<Eigen::Lower>().rankUpdate(dr, weight);
    evidence.g += (weight * r) * dr;
    evidence.weight += weight * weights.sigma_px * weights.sigma_px;
    if (!(s > 0)) continue;
    PlaceEvidence& place = places[PlaceOf(state, match, weights.place_mm)];
    place.D += weight * s * s;
    place.C += (weight * s) * dr;
    place.g += weight * s * r;
  }
  for (auto& [at, place] : places) {
    place.place = at;
    evidence.H.selfadjointView<Eigen::Lower>().rankUpdate(place.C, -1 / (1 + place.D));
    evidence.g -= place.C * (place.g / (1 + place.D));
    evidence.places.push_back(place);
  }
  evidence.H.triangularView<Eigen::StrictlyUpper>() = evidence.H.transpose();
  return evidence;
}

}  // namespace scan
