#include "reconstruction/specimens/photograph.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "reconstruction/render/rasterise.h"
#include "reconstruction/specimens/colour.h"
#include "reconstruction/specimens/solid_noise.h"

namespace scan {
namespace {

using Eigen::Vector3d;

constexpr int kSub = 3;          // samples along a pixel
constexpr double kWhite = 0.9;   // linear value of a white surface
constexpr double kDark = 0.004;  // share of the light that is left when it is off
constexpr int kCoverageSamples = 4;

// 8-bit sRGB of linear values, by table.
class SrgbTable {
 public:
  SrgbTable() {
    for (std::size_t k = 0; k < values_.size(); ++k) {
      const double v = static_cast<double>(k) / static_cast<double>(values_.size() - 1);
      const double s = v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
      values_[k] = static_cast<std::uint8_t>(std::lround(255 * s));
    }
  }
  cv::Vec3b operator()(const Vector3d& rgb) const { return {At(rgb[2]), At(rgb[1]), At(rgb[0])}; }

 private:
  std::uint8_t At(double v) const {
    const double scaled = std::clamp(v, 0.0, 1.0) * static_cast<double>(values_.size() - 1);
    return values_[static_cast<std::size_t>(scaled + 0.5)];
  }
  std::array<std::uint8_t, 16384> values_;
};

struct Light {
  double brightness;
  double vignetting;
  double w, h;

  double At(double x, double y) const {
    const double u = 2 * x / w - 1, v = 2 * y / h - 1;
    return brightness * (1 - vignetting * 0.5 * (u * u + v * v));
  }
};

// A cloth: two colours that blend from top to bottom, times a soft texture. The texture is
// evaluated on every kCell-th pixel and interpolated (its finest wave is 15 px at 1848 px width;
// evaluated at every pixel it took half of the time of a photograph).
class Background {
 public:
  Background(int w, int h) : w_(w), h_(h), texture_(h / kCell + 2, w / kCell + 2, CV_32F) {
    const double wave = 40.0 / w;
    tbb::parallel_for(0, texture_.rows, [&](int j) {
      for (int i = 0; i < texture_.cols; ++i) {
        const double x = i * kCell * wave, y = j * kCell * wave;
        texture_.at<float>(j, i) = static_cast<float>(
            SolidNoise({x, y, 0.5}, 900) + 0.5 * SolidNoise({x * 3.1, y * 3.1, 7.5}, 901));
      }
    });
  }

  Vector3d At(double x, double y) const {
    const double u = x / kCell, v = y / kCell;
    const int i = static_cast<int>(u), j = static_cast<int>(v);
    const double s = u - i, t = v - j;
    const float *upper = texture_.ptr<float>(j) + i, *lower = texture_.ptr<float>(j + 1) + i;
    const double texture =
        (1 - t) * ((1 - s) * upper[0] + s * upper[1]) + t * ((1 - s) * lower[0] + s * lower[1]);
    return specimens::Mix(top_, low_, y / h_ + 0.04 * x / w_) * (1 + 0.025 * texture);
  }

 private:
  static constexpr int kCell = 4;
  const Vector3d top_ = specimens::FromSrgb8(164, 184, 208);
  const Vector3d low_ = specimens::FromSrgb8(122, 146, 178);
  int w_, h_;
  cv::Mat texture_;
};

// Colours of the samples of one picture strip.
class Painter {
 public:
  Painter(const PhotographScene& scene, const CameraFromModel& camera_from_model,
          const Intrinsics& fine, const Raster& raster)
      : scene_(scene),
        camera_from_model_(camera_from_model),
        rotation_(camera_from_model.rotation()),
        fine_(fine),
        raster_(raster),
        towards_light_(Vector3d(-0.35, -0.8, -0.5).normalized()) {}

  // Mean colour of what is seen within pixel (x, y) of the strip; false if no sample hits.
  bool PixelColour(int x, int y, Vector3d& colour) const {
    std::array<std::pair<int, int>, kSub * kSub> hits;
    std::size_t count = 0;
    float nearest = std::numeric_limits<float>::infinity(), farthest = 0;
    for (int v = kSub * y; v < kSub * (y + 1); ++v) {
      for (int u = kSub * x; u < kSub * (x + 1); ++u) {
        if (raster_.face.at<std::int32_t>(v, u) < 0) continue;
        hits[count++] = {u, v};
        nearest = std::min(nearest, raster_.depth_mm.at<float>(v, u));
        farthest = std::max(farthest, raster_.depth_mm.at<float>(v, u));
      }
    }
    if (count == 0) return false;
    const double footprint_mm = kSub * nearest / fine_.fl_x;
    std::array<Vector3d, kSub * kSub> colours;
    const std::size_t middle = count / 2, last = count - 1;
    colours[0] = Sample(hits[0]);
    colours[last] = Sample(hits[last]);
    colours[middle] = Sample(hits[middle]);
    const double contrast = std::max((colours[0] - colours[last]).cwiseAbs().maxCoeff(),
                                     (colours[0] - colours[middle]).cwiseAbs().maxCoeff());
    // Even pixels of one surface need no more samples.
    if (count == hits.size() && contrast < 0.02 && farthest - nearest < 4 * footprint_mm) {
      colour = (colours[0] + colours[middle] + colours[last]) / 3;
      return true;
    }
    colour.setZero();
    for (std::size_t k = 0; k < count; ++k) {
      colour += k == 0 || k == middle || k == last ? colours[k] : Sample(hits[k]);
    }
    colour /= static_cast<double>(count);
    return true;
  }

 private:
  Vector3d Sample(const std::pair<int, int>& at) const {
    const auto [u, v] = at;
    const Face& face =
        scene_.surface.faces[static_cast<std::size_t>(raster_.face.at<std::int32_t>(v, u))];
    const Vector3d in_camera = RayOfPixel(fine_, {u + 0.5, v + 0.5}) *
                               static_cast<double>(raster_.depth_mm.at<float>(v, u));
    const Vector3d p = rotation_.transpose() * (in_camera - camera_from_model_.translation());
    // Barycentric coordinates of p within its face carry the normal.
    const Vector3d &a = scene_.surface.vertices[face[0]], &b = scene_.surface.vertices[face[1]],
                   &c = scene_.surface.vertices[face[2]];
    const Vector3d n = (b - a).cross(c - a);
    const double area2 = std::max(n.squaredNorm(), 1e-30);
    const double wb = std::clamp(n.dot((p - a).cross(c - a)) / area2, 0.0, 1.0);
    const double wc = std::clamp(n.dot((b - a).cross(p - a)) / area2, 0.0, 1.0 - wb);
    const Vector3d normal = ((1 - wb - wc) * scene_.normals[face[0]] +
                             wb * scene_.normals[face[1]] + wc * scene_.normals[face[2]])
                                .normalized();
    const double cosine = (rotation_ * normal).dot(towards_light_);
    const double shade = 1 - scene_.options.shading * 0.5 * (1 - cosine);
    return shade * scene_.specimen->Albedo(p);
  }

  const PhotographScene& scene_;
  const CameraFromModel& camera_from_model_;
  Eigen::Matrix3d rotation_;
  const Intrinsics& fine_;
  const Raster& raster_;
  Vector3d towards_light_;
};

// The picture cut to `strip`, with kSub x kSub samples as its pixels.
Intrinsics Magnified(const Intrinsics& in, const cv::Rect& strip) {
  Intrinsics out = in;
  out.w = kSub * strip.width;
  out.h = kSub * strip.height;
  out.fl_x *= kSub;
  out.fl_y *= kSub;
  out.cx = kSub * (in.cx - strip.x);
  out.cy = kSub * (in.cy - strip.y);
  return out;
}

cv::Rect CoveredRect(const cv::Mat& coverage) {
  int x0 = coverage.cols, x1 = -1, y0 = coverage.rows, y1 = -1;
  for (int y = 0; y < coverage.rows; ++y) {
    const std::uint8_t* row = coverage.ptr<std::uint8_t>(y);
    const std::uint8_t* end = row + coverage.cols;
    const auto is_covered = [](std::uint8_t v) { return v != 0; };
    const std::uint8_t* first = std::find_if(row, end, is_covered);
    if (first == end) continue;
    int last = coverage.cols - 1;
    while (row[last] == 0) --last;
    x0 = std::min(x0, static_cast<int>(first - row));
    x1 = std::max(x1, last);
    y0 = std::min(y0, y);
    y1 = y;
  }
  return x1 < 0 ? cv::Rect() : cv::Rect(x0, y0, x1 - x0 + 1, y1 - y0 + 1);
}

}  // namespace

PhotographScene MakePhotographScene(std::shared_ptr<const Specimen> specimen,
                                    const PhotographOptions& options) {
  assert(specimen);
  PhotographScene scene;
  scene.surface = ExactSurface(*specimen, options.edge_mm);
  scene.normals = VertexNormals(scene.surface);
  scene.specimen = std::move(specimen);
  scene.options = options;
  return scene;
}

cv::Mat TrueCoverage(const PhotographScene& scene, const CameraFromModel& camera_from_model,
                     const Intrinsics& intrinsics) {
  return RasteriseCoverage(scene.surface, camera_from_model, intrinsics, kCoverageSamples);
}

cv::Mat RenderPhotograph(const PhotographScene& scene, const CameraFromModel& camera_from_model,
                         const Intrinsics& intrinsics, const PhotographConditions& conditions) {
  const int w = intrinsics.w, h = intrinsics.h;
  const SrgbTable to_srgb;
  const Light light{kWhite * conditions.exposure * (conditions.light_on ? 1 : kDark),
                    scene.options.vignetting, static_cast<double>(w), static_cast<double>(h)};
  const Background background(w, h);
  cv::Mat picture(h, w, CV_8UC3);
  tbb::parallel_for(0, h, [&](int y) {
    cv::Vec3b* row = picture.ptr<cv::Vec3b>(y);
    for (int x = 0; x < w; ++x) {
      row[x] = to_srgb(light.At(x + 0.5, y + 0.5) * background.At(x + 0.5, y + 0.5));
    }
  });
  if (!conditions.specimen_present) return picture;

  const cv::Mat coverage = TrueCoverage(scene, camera_from_model, intrinsics);
  const cv::Rect covered = CoveredRect(coverage);
  if (covered.empty()) return picture;
  const int strip_rows = std::clamp(400000 / covered.width, 16, covered.height + 16);
  for (int y0 = covered.y; y0 < covered.y + covered.height; y0 += strip_rows) {
    const cv::Rect strip(covered.x, y0, covered.width,
                         std::min(strip_rows, covered.y + covered.height - y0));
    const Intrinsics fine = Magnified(intrinsics, strip);
    const Raster raster = Rasterise(scene.surface, camera_from_model, fine);
    const Painter painter(scene, camera_from_model, fine, raster);
    tbb::parallel_for(0, strip.height, [&](int v) {
      const int y = strip.y + v;
      Vector3d nearest = Vector3d::Constant(0.1);  // for slivers that no sample hits
      for (int u = 0; u < strip.width; ++u) {
        const int x = strip.x + u;
        const std::uint8_t share = coverage.at<std::uint8_t>(y, x);
        if (share == 0) continue;
        if (Vector3d colour; painter.PixelColour(u, v, colour)) nearest = colour;
        const double a = share / 255.0;
        picture.at<cv::Vec3b>(y, x) = to_srgb(
            light.At(x + 0.5, y + 0.5) * (a * nearest + (1 - a) * background.At(x + 0.5, y + 0.5)));
      }
    });
  }
  return picture;
}

}  // namespace scan
