#include "reconstruction/appearance/view_colours.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "reconstruction/render/rasterise.h"

namespace scan {
namespace {

using Eigen::Vector3d;

std::array<float, 256> LinearTable() {
  std::array<float, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double v = static_cast<double>(i) / 255;  // IEC 61966-2-1
    table[i] = static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
  }
  return table;
}

// Photograph, mask and camera, averaged down where they are larger than needed.
struct SmallerView {
  cv::Mat photo, inside;  // CV_8UC3; CV_8U: non-zero a pixel and a half inside the mask
  Intrinsics intrinsics;
};

SmallerView Reduce(const cv::Mat& photo, const Mask& mask, const Intrinsics& intrinsics,
                   int longest_side_px) {
  SmallerView view{photo, mask.coverage >= 250, intrinsics};
  if (!mask.ignore.empty()) view.inside.setTo(0, mask.ignore);
  const int longest = std::max(photo.cols, photo.rows);
  if (longest > longest_side_px) {
    const double scale = static_cast<double>(longest_side_px) / longest;
    const cv::Size size(std::max(1, static_cast<int>(std::lround(photo.cols * scale))),
                        std::max(1, static_cast<int>(std::lround(photo.rows * scale))));
    cv::resize(photo, view.photo, size, 0, 0, cv::INTER_AREA);
    cv::resize(view.inside, view.inside, size, 0, 0, cv::INTER_AREA);
    view.inside = view.inside >= 254;
    view.intrinsics = Scaled(intrinsics, size.width, size.height);
  }
  cv::erode(view.inside, view.inside, cv::getStructuringElement(cv::MORPH_RECT, {3, 3}), {-1, -1},
            1, cv::BORDER_CONSTANT, cv::Scalar(0));
  return view;
}

class NodeProjector {
 public:
  NodeProjector(const SmallerView& view, const TriangleMesh& mesh, const CameraFromModel& pose,
                const ViewColourOptions& options)
      : view_(view),
        options_(options),
        pose_(pose),
        rotation_(pose.rotation()),
        depth_(Rasterise(mesh, pose, view.intrinsics).depth_mm) {}

  void Project(const TurningGrid& grid, std::size_t i, ViewColours& out) const {
    if (std::isnan(grid.relief_mm[i])) return;
    const Vector3d x = pose_ * (grid.position[i] + grid.relief_mm[i] * grid.normal[i]);
    const Vector3d normal = rotation_ * grid.normal[i];
    const double cosine = -normal.dot(x) / x.norm();
    if (!(x.z() > 0 && cosine > options_.least_cosine)) return;
    const auto pixel = scan::Project(view_.intrinsics, x);
    if (!pixel || !Visible(x, cosine, *pixel)) return;
    cv::Vec3f bgr;
    if (!Sample(*pixel, bgr)) return;
    out.colour[0].value[i] = std::log(bgr[2] / bgr[1]);
    out.colour[1].value[i] = std::log(bgr[0] / bgr[1]);
    out.colour[2].value[i] = std::log((bgr[0] + bgr[1] + bgr[2]) / 3);
    for (RingMap& map : out.colour)
      map.weight[i] = static_cast<float>(cosine - options_.least_cosine + 0.05);
    out.normal[i] = normal.cast<float>();
    const Eigen::Vector2d middle(0.5 * view_.intrinsics.w, 0.5 * view_.intrinsics.h);
    out.off_axis2[i] = static_cast<float>((*pixel - middle).squaredNorm() / middle.squaredNorm());
  }

 private:
  bool Visible(const Vector3d& x, double cosine, const Eigen::Vector2d& pixel) const {
    const int u = static_cast<int>(pixel.x()), v = static_cast<int>(pixel.y());
    if (!(u >= 1 && v >= 1 && u < depth_.cols - 1 && v < depth_.rows - 1)) return false;
    if (!view_.inside.at<uchar>(v, u)) return false;
    const double slope = std::sqrt(1 - std::min(1.0, cosine * cosine)) / cosine;
    const double tolerance_mm = x.z() / view_.intrinsics.fl_x * (2 + 2 * slope);
    for (int j = v - 1; j <= v + 1; ++j)
      for (int i = u - 1; i <= u + 1; ++i)
        if (std::abs(depth_.at<float>(j, i) - x.z()) > tolerance_mm) return false;
    return true;
  }

  // Bilinear, linear light; false where a channel is too dark or clipped.
  bool Sample(const Eigen::Vector2d& pixel, cv::Vec3f& bgr) const {
    static const std::array<float, 256> kLinear = LinearTable();
    const double x = pixel.x() - 0.5, y = pixel.y() - 0.5;
    const int u = std::clamp(static_cast<int>(std::floor(x)), 0, view_.photo.cols - 2);
    const int v = std::clamp(static_cast<int>(std::floor(y)), 0, view_.photo.rows - 2);
    const auto s = static_cast<float>(x - u), t = static_cast<float>(y - v);
    const auto *upper = view_.photo.ptr<cv::Vec3b>(v) + u,
               *lower = view_.photo.ptr<cv::Vec3b>(v + 1) + u;
    for (int c = 0; c < 3; ++c) {
      bgr[c] = (1 - t) * ((1 - s) * kLinear[upper[0][c]] + s * kLinear[upper[1][c]]) +
               t * ((1 - s) * kLinear[lower[0][c]] + s * kLinear[lower[1][c]]);
      if (bgr[c] > options_.brightest) return false;
      bgr[c] = std::max(bgr[c], static_cast<float>(0.1 * options_.darkest));
    }
    return std::max({bgr[0], bgr[1], bgr[2]}) > options_.darkest;
  }

  const SmallerView& view_;
  const ViewColourOptions& options_;
  const CameraFromModel& pose_;
  Eigen::Matrix3d rotation_;
  cv::Mat depth_;
};

// What light may do to a node's colour in one view; the constant is the view's own.
constexpr int kLightTerms = 9;
Eigen::Matrix<double, kLightTerms, 1> LightTerms(const ViewColours& view, std::size_t i) {
  const Eigen::Vector3d n = view.normal[i].cast<double>();
  Eigen::Matrix<double, kLightTerms, 1> terms;
  terms << n, n.x() * n.y(), n.y() * n.z(), n.z() * n.x(), n.x() * n.x() - n.y() * n.y(),
      3 * n.z() * n.z() - 1, view.off_axis2[i];
  return terms;
}

// Rows of one node: what each view that sees it shows and how that depends on the light's
// coefficients.
struct NodeRows {
  std::vector<Eigen::VectorXd> row;
  std::vector<double> value, weight;
};

class LightFit {
 public:
  LightFit(std::span<const ViewColours> views, int channel)
      : views_(views), channel_(static_cast<std::size_t>(channel)) {
    for (const ViewColours& view : views) lightings_ = std::max(lightings_, view.lighting + 1);
    unknowns_ = lightings_ * kLightTerms + static_cast<int>(views.size());
  }

  // Robust weights: three rounds of Huber's.
  Eigen::VectorXd Solve() const {
    Eigen::VectorXd light = Eigen::VectorXd::Zero(unknowns_);
    double scale = std::numeric_limits<double>::infinity();
    for (int round = 0; round < 3; ++round) light = Round(light, scale);
    return light;
  }

  Eigen::VectorXd Row(std::size_t view, std::size_t node) const {
    Eigen::VectorXd row = Eigen::VectorXd::Zero(unknowns_);
    row.segment<kLightTerms>(views_[view].lighting * kLightTerms) = LightTerms(views_[view], node);
    row[lightings_ * kLightTerms + static_cast<int>(view)] = 1;
    return row;
  }

 private:
  NodeRows RowsOf(std::size_t node) const {
    NodeRows rows;
    for (std::size_t v = 0; v < views_.size(); ++v) {
      const RingMap& map = views_[v].colour[channel_];
      if (!(map.weight[node] > 0)) continue;
      rows.row.push_back(Row(v, node));
      rows.value.push_back(map.value[node]);
      rows.weight.push_back(map.weight[node]);
    }
    return rows;
  }

  // The node's own colour is eliminated: only differences between its views count.
  Eigen::VectorXd Round(const Eigen::VectorXd& light, double& scale) const {
    const int azimuths = views_[0].colour[0].azimuths, rings = views_[0].colour[0].rings;
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(unknowns_, unknowns_);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(unknowns_);
    double squares = 0, count = 0;
    for (int j = 0; j < rings; j += 2) {
      for (int k = 0; k < azimuths; k += 8) {
        NodeRows rows = RowsOf(static_cast<std::size_t>(views_[0].colour[0].index(j, k)));
        if (rows.row.size() < 2) continue;
        Eigen::VectorXd mean_row = Eigen::VectorXd::Zero(unknowns_);
        double mean = 0, sum = 0;
        for (std::size_t i = 0; i < rows.row.size(); ++i) {
          mean_row += rows.weight[i] * rows.row[i];
          mean += rows.weight[i] * rows.value[i];
          sum += rows.weight[i];
        }
        mean_row /= sum;
        mean /= sum;
        for (std::size_t i = 0; i < rows.row.size(); ++i) {
          const Eigen::VectorXd row = rows.row[i] - mean_row;
          const double value = rows.value[i] - mean, residual = value - row.dot(light);
          const double w =
              rows.weight[i] * std::min(1.0, scale / std::max(std::abs(residual), 1e-12));
          H.selfadjointView<Eigen::Lower>().rankUpdate(row, w);
          b += w * value * row;
          squares += w * residual * residual;
          count += w;
        }
      }
    }
    if (!(count > 0)) return light;
    scale = 1.5 * std::sqrt(squares / count);
    H.triangularView<Eigen::StrictlyUpper>() = H.transpose();
    // What no difference shows stays zero.
    H.diagonal().array() += 1e-4 * count / unknowns_;
    return H.ldlt().solve(b);
  }

  std::span<const ViewColours> views_;
  std::size_t channel_;
  int lightings_ = 1, unknowns_ = 0;
};

}  // namespace

ViewColours BackProject(const TurningGrid& grid, const TriangleMesh& mesh, const cv::Mat& photo,
                        const Mask& mask, const CameraFromModel& camera_from_model,
                        const Intrinsics& intrinsics, const ViewColourOptions& options) {
  assert(photo.type() == CV_8UC3 && photo.cols == intrinsics.w && photo.rows == intrinsics.h);
  ViewColours out;
  out.colour.fill(MakeRingMap(grid));
  out.normal.assign(grid.size(), Eigen::Vector3f::Zero());
  out.off_axis2.assign(grid.size(), 0.f);
  const SmallerView view = Reduce(photo, mask, intrinsics, options.longest_side_px);
  const NodeProjector projector(view, mesh, camera_from_model, options);
  tbb::parallel_for(std::size_t{0}, grid.size(),
                    [&](std::size_t i) { projector.Project(grid, i, out); });
  return out;
}

void LevelLight(std::span<ViewColours> views) {
  if (views.empty()) return;
  std::array<Eigen::VectorXd, kColourChannels> light;
  tbb::parallel_for(0, kColourChannels, [&](int c) {
    light[static_cast<std::size_t>(c)] = LightFit(views, c).Solve();
  });
  tbb::parallel_for(std::size_t{0}, views.size(), [&](std::size_t v) {
    const LightFit rows(views, 0);
    for (std::size_t i = 0; i < views[v].colour[0].size(); ++i) {
      if (!(views[v].colour[0].weight[i] > 0)) continue;
      const Eigen::VectorXd row = rows.Row(v, i);
      for (std::size_t c = 0; c < kColourChannels; ++c)
        views[v].colour[c].value[i] -= static_cast<float>(row.dot(light[c]));
    }
  });
}

ColourMaps Merged(std::span<const ViewColours> views) {
  ColourMaps merged;
  if (views.empty()) return merged;
  for (std::size_t c = 0; c < kColourChannels; ++c) {
    RingMap& map = merged[c];
    map = views[0].colour[c];
    std::fill(map.value.begin(), map.value.end(), 0.f);
    std::fill(map.weight.begin(), map.weight.end(), 0.f);
    for (const ViewColours& view : views) {
      for (std::size_t i = 0; i < map.size(); ++i) {
        map.value[i] += view.colour[c].weight[i] * view.colour[c].value[i];
        map.weight[i] += view.colour[c].weight[i];
      }
    }
    for (std::size_t i = 0; i < map.size(); ++i)
      if (map.weight[i] > 0) map.value[i] /= map.weight[i];
  }
  return merged;
}

Agreement AgreementOf(std::span<const ViewColours> views) {
  Agreement agreement;
  ColourMaps merged = Merged(views);
  double seen = 0, seen_twice = 0;
  for (std::size_t c = 0; c < kColourChannels; ++c) {
    RingMap own = merged[c];
    TakeOffRingMeans(own);  // the profile's own colour is in common whatever the turn
    double within = 0, between = 0, freedom = 0;
    for (std::size_t i = 0; i < own.size(); ++i) {
      double squares = 0;
      int count = 0;
      for (const ViewColours& view : views) {
        if (!(view.colour[c].weight[i] > 0)) continue;
        squares += std::pow(view.colour[c].value[i] - merged[c].value[i], 2);
        ++count;
      }
      if (c == 0) seen += count > 0, seen_twice += count > 1;
      if (count < 2) continue;
      within += squares;
      freedom += count - 1;
      between += static_cast<double>(count - 1) * std::pow(own.value[i], 2);
    }
    agreement.noise[c] = freedom > 0 ? std::sqrt(within / freedom) : 0;
    if (within + between > 0) agreement.share += between / (within + between) / kColourChannels;
  }
  agreement.overlaps = seen > 0 ? seen_twice / seen : 0;
  return agreement;
}

}  // namespace scan
