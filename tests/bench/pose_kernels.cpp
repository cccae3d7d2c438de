// The inner loops of the pose search beside the plain way to do the same and beside the library
// that does it.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <opencv2/imgproc.hpp>
#ifdef SCAN_HAVE_EMBREE
#include <embree3/rtcore.h>
#endif

#include "clocks.h"
#include "reconstruction/pose/picture_cost.h"
#include "reconstruction/pose/start_search.h"
#include "reconstruction/pose/start_templates.h"
#include "reconstruction/render/rasterise.h"
#include "reconstruction/specimens/specimen.h"

namespace scan {
namespace {

struct KernelOptions {
  std::string specimen = "beetle";
  double edge_mm = 0.065;  // of the beetle: 500 thousand faces
  int rounds = 5;
};

struct Cost {
  double wall_ms = 0, processor_ms = 0;
};

// The least of several rounds: what the machine does beside it only adds.
Cost CostOf(int rounds, int repeats, const std::function<void()>& work) {
  Cost least{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  for (int i = 0; i < rounds; ++i) {
    const double wall = bench::Seconds(), processor = bench::ProcessorSeconds();
    for (int k = 0; k < repeats; ++k) work();
    least.wall_ms = std::min(least.wall_ms, 1e3 * (bench::Seconds() - wall) / repeats);
    least.processor_ms =
        std::min(least.processor_ms, 1e3 * (bench::ProcessorSeconds() - processor) / repeats);
  }
  return least;
}

void PrintRow(const char* name, const Cost& cost, const Cost& ours, const std::string& remark) {
  fmt::print("  {:<52} {:10.4f} ms {:10.4f} ms of processor {:7.2f} x   {}\n", name, cost.wall_ms,
             cost.processor_ms, cost.processor_ms / ours.processor_ms, remark);
}

Intrinsics CameraOf(int width, int height) {
  Intrinsics in;
  in.w = width;
  in.h = height;
  in.fl_x = in.fl_y = 70 / 23.6 * width;
  in.cx = 0.5 * width;
  in.cy = 0.5 * height;
  return in;
}

CameraFromModel ViewOf(const TriangleMesh& mesh) {
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(2, Eigen::Vector3d(0.8, 0.5, 0.3).normalized()).toRotationMatrix();
  return CameraFromModel(rotation, Eigen::Vector3d(0, 0, 550) - rotation * MassCentre(mesh));
}

// Every pixel centre of every face's box asked on which side of the three edges it lies.
Raster PlainRaster(const TriangleMesh& mesh, const CameraFromModel& camera_from_model,
                   const Intrinsics& in) {
  Raster raster{cv::Mat(in.h, in.w, CV_32F, cv::Scalar(std::numeric_limits<float>::infinity())),
                cv::Mat(in.h, in.w, CV_32S, cv::Scalar(-1))};
  std::vector<Eigen::Vector3d> seen(mesh.vertices.size());  // px, px, 1 / z
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Eigen::Vector3d p = camera_from_model * mesh.vertices[i];
    seen[i] = {in.fl_x * p.x() / p.z() + in.cx, in.fl_y * p.y() / p.z() + in.cy, 1 / p.z()};
  }
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const Eigen::Vector3d &a = seen[mesh.faces[f][0]], &b = seen[mesh.faces[f][1]],
                          &c = seen[mesh.faces[f][2]];
    const double area = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
    if (area == 0) continue;
    const auto [x0, x1] = std::minmax({a.x(), b.x(), c.x()});
    const auto [y0, y1] = std::minmax({a.y(), b.y(), c.y()});
    for (int y = std::max(0, static_cast<int>(std::floor(y0)));
         y <= std::min(in.h - 1, static_cast<int>(y1)); ++y)
      for (int x = std::max(0, static_cast<int>(std::floor(x0)));
           x <= std::min(in.w - 1, static_cast<int>(x1)); ++x) {
        const double px = x + 0.5, py = y + 0.5;
        const double u = ((px - a.x()) * (c.y() - a.y()) - (py - a.y()) * (c.x() - a.x())) / area;
        const double v = ((b.x() - a.x()) * (py - a.y()) - (b.y() - a.y()) * (px - a.x())) / area;
        if (u < 0 || v < 0 || u + v > 1) continue;
        const double z = 1 / (a.z() + u * (b.z() - a.z()) + v * (c.z() - a.z()));
        float& depth = raster.depth_mm.at<float>(y, x);
        if (!(z < depth)) continue;
        depth = static_cast<float>(z);
        raster.face.at<int>(y, x) = static_cast<int>(f);
      }
  }
  return raster;
}

// Share of the pixels that either covers whose face, or whose depth to a hundredth of a mm, is not
// the same.
std::string Difference(const Raster& a, const Raster& b) {
  std::size_t covered = 0, faces = 0, depths = 0;
  for (int y = 0; y < a.face.rows; ++y)
    for (int x = 0; x < a.face.cols; ++x) {
      const int fa = a.face.at<int>(y, x), fb = b.face.at<int>(y, x);
      if (fa < 0 && fb < 0) continue;
      ++covered;
      faces += fa != fb;
      depths += !(std::abs(a.depth_mm.at<float>(y, x) - b.depth_mm.at<float>(y, x)) < 0.01f);
    }
  return fmt::format("{:.4f} % other faces, {:.4f} % other depths",
                     100.0 * static_cast<double>(faces) / static_cast<double>(covered),
                     100.0 * static_cast<double>(depths) / static_cast<double>(covered));
}

#ifdef SCAN_HAVE_EMBREE
// A ray through every pixel centre, sixteen at a time.
class EmbreeScene {
 public:
  explicit EmbreeScene(const TriangleMesh& mesh) : device_(rtcNewDevice(nullptr)) {
    scene_ = rtcNewScene(device_);
    const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                3 * sizeof(float), mesh.vertices.size()));
    auto* faces = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(unsigned), mesh.faces.size()));
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
      for (int k = 0; k < 3; ++k) vertices[3 * i + k] = static_cast<float>(mesh.vertices[i][k]);
    for (std::size_t f = 0; f < mesh.faces.size(); ++f)
      for (int k = 0; k < 3; ++k) faces[3 * f + k] = mesh.faces[f][k];
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;
  ~EmbreeScene() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }

  Raster Render(const CameraFromModel& camera_from_model, const Intrinsics& in) const {
    Raster raster{cv::Mat(in.h, in.w, CV_32F), cv::Mat(in.h, in.w, CV_32S)};
    const Eigen::Matrix3d back = camera_from_model.rotation().transpose();
    const Eigen::Vector3d centre = -back * camera_from_model.translation();
    tbb::parallel_for(0, in.h, [&](int y) {
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
      for (int x0 = 0; x0 < in.w; x0 += 16) {
        const int count = std::min(16, in.w - x0);
        alignas(64) int valid[16];
        RTCRayHit16 rays{};
        for (int k = 0; k < 16; ++k) {
          valid[k] = k < count ? -1 : 0;
          // Its third component in the camera frame is 1: tfar is the depth.
          const Eigen::Vector3d ray = back * Eigen::Vector3d((x0 + k + 0.5 - in.cx) / in.fl_x,
                                                             (y + 0.5 - in.cy) / in.fl_y, 1);
          rays.ray.org_x[k] = static_cast<float>(centre.x());
          rays.ray.org_y[k] = static_cast<float>(centre.y());
          rays.ray.org_z[k] = static_cast<float>(centre.z());
          rays.ray.dir_x[k] = static_cast<float>(ray.x());
          rays.ray.dir_y[k] = static_cast<float>(ray.y());
          rays.ray.dir_z[k] = static_cast<float>(ray.z());
          rays.ray.tnear[k] = 0;
          rays.ray.tfar[k] = std::numeric_limits<float>::infinity();
          rays.ray.mask[k] = ~0u;
          rays.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
        }
        rtcIntersect16(valid, scene_, &context, &rays);
        for (int k = 0; k < count; ++k) {
          const bool hit = rays.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID;
          raster.depth_mm.at<float>(y, x0 + k) =
              hit ? rays.ray.tfar[k] : std::numeric_limits<float>::infinity();
          raster.face.at<int>(y, x0 + k) = hit ? static_cast<int>(rays.hit.primID[k]) : -1;
        }
      }
    });
    return raster;
  }

 private:
  RTCDevice device_;
  RTCScene scene_ = nullptr;
};
#endif

void CompareRasterisers(const TriangleMesh& mesh, int rounds) {
  const Intrinsics in = CameraOf(3696, 2448);
  const CameraFromModel view = ViewOf(mesh);
  fmt::print("depth and face of every pixel, {} x {}, {} faces, all cores\n", in.w, in.h,
             mesh.faces.size());
  Raster ours, other;
  const Cost cost = CostOf(rounds, 1, [&] { ours = Rasterise(mesh, view, in); });
  PrintRow("Rasterise", cost, cost, "");
  const Cost plain = CostOf(rounds, 1, [&] { other = PlainRaster(mesh, view, in); });
  PrintRow("every pixel of every face's box, one core", plain, cost, Difference(ours, other));
#ifdef SCAN_HAVE_EMBREE
  const double start = bench::Seconds();
  const EmbreeScene scene(mesh);
  const double built_ms = 1e3 * (bench::Seconds() - start);
  const Cost embree = CostOf(rounds, 1, [&] { other = scene.Render(view, in); });
  PrintRow(
      "Embree, rays in packets of 16", embree, cost,
      fmt::format("{}; {:.0f} ms more to prepare the mesh", Difference(ours, other), built_ms));
#else
  fmt::print("  Embree is not installed (libembree-dev)\n");
#endif
}

void CompareSilhouettes(const TriangleMesh& mesh, int rounds) {
  const Intrinsics in = CameraOf(kReducedSide, 306);
  const CameraFromModel view = ViewOf(mesh);
  const TriangleMesh coarse = ClusteredMesh(mesh, 0.45);
  fmt::print("covered pixels, {} x {}, {} faces, one core\n", in.w, in.h, coarse.faces.size());
  cv::Mat ours, other(in.h, in.w, CV_8U);
  const Cost cost = CostOf(rounds, 50, [&] { ours = RenderReduced(coarse, view, in); });
  PrintRow("RenderReduced", cost, cost, "");
  const auto differ = [&] {
    return fmt::format("{} of {} pixels differ", cv::countNonZero(ours != other),
                       cv::countNonZero(ours));
  };
  const Cost depth = CostOf(rounds, 50, [&] { other = RasteriseMask(coarse, view, in); });
  PrintRow("RasteriseMask, all cores", depth, cost, differ());
  const Cost opencv = CostOf(rounds, 50, [&] {
    other.setTo(0);
    std::vector<cv::Point> pixels(coarse.vertices.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const Eigen::Vector3d p = view * coarse.vertices[i];
      pixels[i] = {static_cast<int>(std::floor(in.fl_x * p.x() / p.z() + in.cx)),
                   static_cast<int>(std::floor(in.fl_y * p.y() / p.z() + in.cy))};
    }
    for (const Face& f : coarse.faces) {
      const cv::Point corners[] = {pixels[f[0]], pixels[f[1]], pixels[f[2]]};
      cv::fillConvexPoly(other, corners, 3, cv::Scalar(255));
    }
  });
  PrintRow("OpenCV, fillConvexPoly per face (corners in whole px)", opencv, cost, differ());
}

// Two passes over the picture, each pixel from its neighbours before it.
cv::Mat PlainDistance(const cv::Mat& seeds) {
  cv::Mat distance(seeds.size(), CV_32F);
  const float far = static_cast<float>(seeds.cols + seeds.rows);
  for (int y = 0; y < seeds.rows; ++y)
    for (int x = 0; x < seeds.cols; ++x) {
      float d = seeds.at<uchar>(y, x) ? far : 0;
      if (y > 0) d = std::min(d, distance.at<float>(y - 1, x) + 1);
      if (x > 0) d = std::min(d, distance.at<float>(y, x - 1) + 1);
      distance.at<float>(y, x) = d;
    }
  for (int y = seeds.rows - 1; y >= 0; --y)
    for (int x = seeds.cols - 1; x >= 0; --x) {
      float& d = distance.at<float>(y, x);
      if (y + 1 < seeds.rows) d = std::min(d, distance.at<float>(y + 1, x) + 1);
      if (x + 1 < seeds.cols) d = std::min(d, distance.at<float>(y, x + 1) + 1);
    }
  return distance;
}

void CompareDistanceImages(const TriangleMesh& mesh, int rounds) {
  const Intrinsics in = CameraOf(kReducedSide, 306);
  const cv::Mat mask = RasteriseMask(mesh, ViewOf(mesh), in);
  cv::Mat seeds(mask.size(), CV_8U, cv::Scalar(255)), used;
  for (const cv::Point& p : BoundaryPixels(mask)) seeds.at<uchar>(p) = 0;
  fmt::print("city-block distance image, {} x {}, one core\n", in.w, in.h);
  const Cost cost =
      CostOf(rounds, 50, [&] { cv::distanceTransform(seeds, used, cv::DIST_L1, 3, CV_32F); });
  PrintRow("OpenCV, distanceTransform: in use", cost, cost, "");
  cv::Mat other;
  const Cost plain = CostOf(rounds, 50, [&] { other = PlainDistance(seeds); });
  PrintRow("two passes over the picture", plain, cost,
           fmt::format("largest difference {} px", cv::norm(used, other, cv::NORM_INF)));
}

// Bilinear, in the reduced photograph's own distance image.
float PlainScore(const cv::Mat& distance, const std::vector<Eigen::Vector2f>& boundary, float angle,
                 const Eigen::Vector2f& centroid) {
  const Eigen::Matrix2f turn = Eigen::Rotation2Df(angle).toRotationMatrix();
  float sum = 0;
  for (const Eigen::Vector2f& p : boundary) {
    const Eigen::Vector2f q = turn * p + centroid;
    const int x = std::clamp(static_cast<int>(q.x()), 0, distance.cols - 2);
    const int y = std::clamp(static_cast<int>(q.y()), 0, distance.rows - 2);
    const float u = q.x() - static_cast<float>(x), v = q.y() - static_cast<float>(y);
    sum += (1 - v) * ((1 - u) * distance.at<float>(y, x) + u * distance.at<float>(y, x + 1)) +
           v * ((1 - u) * distance.at<float>(y + 1, x) + u * distance.at<float>(y + 1, x + 1));
  }
  return sum / static_cast<float>(boundary.size());
}

void CompareScores(const TriangleMesh& mesh, int rounds) {
  const Intrinsics in = CameraOf(kReducedSide, 306);
  const CameraFromModel view = ViewOf(mesh);
  const ReducedPicture picture =
      ReducePicture({.coverage = RasteriseMask(mesh, view, in), .ignore = {}}, in);
  std::vector<Eigen::Vector2f> boundary;
  const cv::Moments m = cv::moments(picture.mask, true);
  const Eigen::Vector2f centroid(static_cast<float>(m.m10 / m.m00),
                                 static_cast<float>(m.m01 / m.m00));
  for (const cv::Point& p : BoundaryPixels(picture.mask))
    boundary.emplace_back(static_cast<float>(p.x) - centroid.x(),
                          static_cast<float>(p.y) - centroid.y());
  constexpr int kAngles = 72, kPoints = 48;
  const auto root_area = static_cast<float>(std::sqrt(m.m00));
  std::vector<Eigen::Vector2f> scaled = boundary;
  for (Eigen::Vector2f& p : scaled) p /= root_area;
  const start::Silhouette silhouette = start::MakeSilhouette(scaled, root_area, kPoints);
  fmt::print("score of a silhouette at {} angles, one core\n", kAngles);
  float sum = 0;  // printed, so that nothing is left out
  const float step = 6.2831853f / kAngles;
  const Cost cost = CostOf(rounds, 200, [&] {
    for (int a = 0; a < kAngles; ++a)
      sum += start::MeanDistance(silhouette.field, start::Rotated(silhouette.points, a * step));
  });
  PrintRow("MeanDistance, 48 points, turned each time", cost, cost, "");
  const Cost plain = CostOf(rounds, 20, [&] {
    for (int a = 0; a < kAngles; ++a)
      sum += PlainScore(picture.distance_l1, boundary, static_cast<float>(a) * step, centroid);
  });
  PrintRow("Eq 3 over the whole boundary, bilinear", plain, cost,
           fmt::format("{} points", boundary.size()));
  cv::Mat map(1, static_cast<int>(boundary.size()), CV_32FC2), values;
  const Cost opencv = CostOf(rounds, 20, [&] {
    for (int a = 0; a < kAngles; ++a) {
      const Eigen::Matrix2f turn =
          Eigen::Rotation2Df(static_cast<float>(a) * step).toRotationMatrix();
      for (std::size_t i = 0; i < boundary.size(); ++i) {
        const Eigen::Vector2f q = turn * boundary[i] + centroid;
        map.at<cv::Vec2f>(0, static_cast<int>(i)) = {q.x(), q.y()};
      }
      cv::remap(picture.distance_l1, values, map, cv::noArray(), cv::INTER_LINEAR);
      sum += static_cast<float>(cv::mean(values)[0]);
    }
  });
  PrintRow("the same by OpenCV's remap", opencv, cost, fmt::format("(sum {:.3g})", sum));
}

}  // namespace
}  // namespace scan

int main(int argc, char** argv) {
  scan::KernelOptions options;
  CLI::App app("Inner loops of the pose search beside plain code and libraries",
               "bench_pose_kernels");
  app.add_option("--specimen", options.specimen)
      ->check(CLI::IsMember(scan::SpecimenNames()))
      ->capture_default_str();
  app.add_option("--edge-mm", options.edge_mm, "of the mesh")
      ->check(CLI::Range(0.05, 5.0))
      ->capture_default_str();
  app.add_option("--rounds", options.rounds, "of each, the least counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const scan::TriangleMesh mesh =
      scan::ExactSurface(*scan::MakeSpecimen(options.specimen).value(), options.edge_mm);
  scan::CompareRasterisers(mesh, options.rounds);
  scan::CompareSilhouettes(mesh, options.rounds);
  scan::CompareDistanceImages(mesh, options.rounds);
  scan::CompareScores(mesh, options.rounds);
}
