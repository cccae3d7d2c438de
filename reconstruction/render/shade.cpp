#include "reconstruction/render/shade.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "reconstruction/render/rasterise.h"

namespace scan {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kSamples = 3;  // a side of a pixel
constexpr double kFar = 20;  // camera distance in diagonals: nearly orthographic
constexpr int kSkyDirections = 96;
constexpr int kSkyPixels = 384;
constexpr float kGrey = 0.62f;  // linear

struct View {
  CameraFromModel camera_from_model;
  Intrinsics camera;
};

// Looks at `centre` from `distance` along the third column of `right_down_forward`; the picture
// just holds what spans the half width and height about it.
View LookAlong(const Eigen::Matrix3d& right_down_forward, const Vector3d& centre, double distance,
               double half_width_mm, double half_height_mm, int height_px) {
  View v;
  const Eigen::Matrix3d rotation = right_down_forward.transpose();
  v.camera_from_model = CameraFromModel(rotation, Vector3d(0, 0, distance) - rotation * centre);
  const double px_per_mm = height_px / (2 * half_height_mm);
  v.camera.h = height_px;
  v.camera.w = std::max(1, static_cast<int>(std::ceil(2 * half_width_mm * px_per_mm)));
  v.camera.fl_x = v.camera.fl_y = px_per_mm * distance;
  v.camera.cx = 0.5 * v.camera.w;
  v.camera.cy = 0.5 * v.camera.h;
  return v;
}

// Columns: longest, middle, thinnest axis of the surface, right-handed, signs fixed.
Eigen::Matrix3d PrincipalAxes(const TriangleMesh& mesh) {
  Vector3d mean = Vector3d::Zero();
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  double area = 0;
  for (const Face& f : mesh.faces) {
    const Vector3d &a = mesh.vertices[f[0]], &b = mesh.vertices[f[1]], &c = mesh.vertices[f[2]];
    const double w = (b - a).cross(c - a).norm();
    const Vector3d m = (a + b + c) / 3;
    area += w;
    mean += w * m;
    moment += w / 12 *
              (9 * m * m.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
  }
  if (!(area > 0)) return Eigen::Matrix3d::Identity();
  mean /= area;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moment / area -
                                                              mean * mean.transpose());
  Eigen::Matrix3d axes;
  for (int k = 0; k < 3; ++k) {
    Vector3d axis = solver.eigenvectors().col(2 - k);
    Eigen::Index largest = 0;
    axis.cwiseAbs().maxCoeff(&largest);
    axes.col(k) = axis[largest] < 0 ? Vector3d(-axis) : axis;
  }
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

// Evenly over the sphere (Fibonacci lattice).
Vector3d SkyDirection(int n) {
  const double z = 1 - (2.0 * n + 1) / kSkyDirections;
  const double angle = n * std::numbers::pi * (3 - std::sqrt(5.0));
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

std::uint8_t ToSrgb(float linear) {
  const float c = std::clamp(linear, 0.0f, 1.0f);
  const float s = c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1 / 2.4f) - 0.055f;
  return static_cast<std::uint8_t>(std::lround(255 * s));
}

struct Lit {
  const TriangleMesh& mesh;
  const std::vector<Vector3f>& colour;
  std::vector<Vector3d> normals;
  std::vector<float> sky;
};

// Weights of the corners of a face at a point of its plane.
Vector3d Barycentric(const TriangleMesh& mesh, const Face& f, const Vector3d& p) {
  const Vector3d &a = mesh.vertices[f[0]], &b = mesh.vertices[f[1]], &c = mesh.vertices[f[2]];
  const Vector3d n = (b - a).cross(c - a);
  const double nn = n.squaredNorm();
  if (!(nn > 0)) return {1, 0, 0};
  Vector3d w{(c - b).cross(p - b).dot(n) / nn, (a - c).cross(p - c).dot(n) / nn, 0};
  w = w.cwiseMax(0.0).cwiseMin(1.0);
  w[2] = std::max(0.0, 1 - w[0] - w[1]);
  return w / w.sum();
}

Vector3f Shade(const Lit& lit, const View& view, int row, int column, float depth,
               std::uint32_t face) {
  const Vector3d ray = RayOfPixel(view.camera, Eigen::Vector2d(column + 0.5, row + 0.5)) *
                       static_cast<double>(depth);
  const Vector3d p = view.camera_from_model.inverse() * ray;
  const Face& f = lit.mesh.faces[face];
  const Vector3d w = Barycentric(lit.mesh, f, p);
  Vector3d n = w[0] * lit.normals[f[0]] + w[1] * lit.normals[f[1]] + w[2] * lit.normals[f[2]];
  n = (view.camera_from_model.rotation() * n).normalized();
  if (n.z() > 0) n = -n;  // seen from behind
  const float sky =
      static_cast<float>(w[0] * lit.sky[f[0]] + w[1] * lit.sky[f[1]] + w[2] * lit.sky[f[2]]);
  const Vector3d key = Vector3d(-0.45, -0.6, -0.66).normalized();
  const float direct = static_cast<float>(std::max(0.0, n.dot(key)));
  const float light = sky * (0.45f + 0.2f * static_cast<float>(-n.y()) + 0.65f * direct);
  const Vector3f base = lit.colour.empty() ? Vector3f(Vector3f::Constant(kGrey)) : lit.colour[face];
  return base * light;
}

cv::Mat Panel(const Lit& lit, const View& view) {
  const Raster raster = Rasterise(lit.mesh, view.camera_from_model, view.camera);
  cv::Mat linear(view.camera.h, view.camera.w, CV_32FC3, cv::Scalar(1, 1, 1));
  tbb::parallel_for(0, view.camera.h, [&](int row) {
    for (int column = 0; column < view.camera.w; ++column) {
      const std::int32_t face = raster.face.at<std::int32_t>(row, column);
      if (face < 0) continue;
      const Vector3f c = Shade(lit, view, row, column, raster.depth_mm.at<float>(row, column),
                               static_cast<std::uint32_t>(face));
      linear.at<cv::Vec3f>(row, column) = {c[2], c[1], c[0]};
    }
  });
  cv::Mat small;
  cv::resize(linear, small, {}, 1.0 / kSamples, 1.0 / kSamples, cv::INTER_AREA);
  cv::Mat out(small.size(), CV_8UC3);
  for (int row = 0; row < out.rows; ++row)
    for (int column = 0; column < out.cols; ++column)
      for (int c = 0; c < 3; ++c)
        out.at<cv::Vec3b>(row, column)[c] = ToSrgb(small.at<cv::Vec3f>(row, column)[c]);
  return out;
}

}  // namespace

std::vector<float> SkyShare(const TriangleMesh& mesh) {
  const std::vector<Vector3d> normals = VertexNormals(mesh);
  const BoundingBox box = BoundsOf(mesh);
  const double radius = std::max(0.5 * box.diagonal(), 1e-9), distance = kFar * radius;
  const double tolerance_mm = 3 * radius / kSkyPixels;
  std::vector<float> seen(mesh.vertices.size(), 0), all(mesh.vertices.size(), 0);
  for (int n = 0; n < kSkyDirections; ++n) {
    const Vector3d from = SkyDirection(n), forward = -from, right = forward.unitOrthogonal();
    Eigen::Matrix3d axes;
    axes << right, forward.cross(right), forward;
    const View view =
        LookAlong(axes, box.centre(), distance, 1.05 * radius, 1.05 * radius, kSkyPixels);
    const Raster raster = Rasterise(mesh, view.camera_from_model, view.camera);
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, mesh.vertices.size()), [&](const auto& range) {
          for (std::size_t v = range.begin(); v < range.end(); ++v) {
            const float cosine = static_cast<float>(normals[v].dot(from));
            if (cosine <= 0) continue;
            all[v] += cosine;
            // From a little above the surface, else its own slope hides it.
            const Vector3d p =
                view.camera_from_model * (mesh.vertices[v] + 0.5 * tolerance_mm * normals[v]);
            const auto at = Project(view.camera, p);
            if (!at) continue;
            const int x = std::clamp(static_cast<int>(at->x()), 0, view.camera.w - 1);
            const int y = std::clamp(static_cast<int>(at->y()), 0, view.camera.h - 1);
            if (p.z() <= static_cast<double>(raster.depth_mm.at<float>(y, x)) + tolerance_mm)
              seen[v] += cosine;
          }
        });
  }
  for (std::size_t v = 0; v < seen.size(); ++v) seen[v] = all[v] > 0 ? seen[v] / all[v] : 0;
  return seen;
}

cv::Mat ShadedPicture(const TriangleMesh& mesh, const std::vector<Vector3f>& colour,
                      const ShadeOptions& options) {
  const Lit lit{mesh, colour, VertexNormals(mesh), SkyShare(mesh)};
  const Eigen::Matrix3d axes = PrincipalAxes(mesh);
  const BoundingBox box = BoundsOf(mesh);
  std::vector<cv::Mat> panels;
  for (int side = 0; side < options.sides; ++side) {
    const double turn = 2 * std::numbers::pi * side / options.sides;
    Eigen::Matrix3d right_down_forward;
    const Vector3d forward = Eigen::AngleAxisd(turn, axes.col(0)) * Vector3d(axes.col(2));
    const Vector3d down = -axes.col(0);
    right_down_forward << down.cross(forward), down, forward;
    Vector3d low = Vector3d::Constant(1e300), high = -low;
    for (const Vector3d& v : mesh.vertices) {
      const Vector3d p = right_down_forward.transpose() * (v - box.centre());
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    const Vector3d half = 0.53 * (high - low).cwiseMax(1e-9);
    const Vector3d centre = box.centre() + right_down_forward * (0.5 * (low + high));
    const double distance = kFar * std::max(box.diagonal(), 1e-9);
    panels.push_back(Panel(lit, LookAlong(right_down_forward, centre, distance, half.x(), half.y(),
                                          kSamples * options.height_px)));
  }
  cv::Mat picture;
  cv::hconcat(panels, picture);
  return picture;
}

}  // namespace scan
