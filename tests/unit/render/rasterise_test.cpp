#include "reconstruction/render/rasterise.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>

#include "drivers/base/rng.h"
#include "tests/support/meshes.h"

namespace scan {
namespace {

Intrinsics Camera(int w, int h, double focal) {
  Intrinsics in;
  in.w = w;
  in.h = h;
  in.fl_x = in.fl_y = focal;
  in.cx = w / 2.0;
  in.cy = h / 2.0;
  return in;
}

// Places picture coordinates (px) at depth 1 mm of a camera with unit focal length.
Intrinsics FlatCamera(int w, int h) {
  Intrinsics in = Camera(w, h, 1);
  in.cx = in.cy = 0;
  return in;
}

TriangleMesh Flat(const std::vector<Eigen::Vector2d>& points, std::vector<Face> faces,
                  double z = 1) {
  TriangleMesh mesh;
  for (const auto& p : points) mesh.vertices.push_back({p.x() * z, p.y() * z, z});
  mesh.faces = std::move(faces);
  return mesh;
}

CameraFromModel LookFrom(const Eigen::Vector3d& direction, double distance_mm, double roll_rad) {
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
      Eigen::Quaterniond::FromTwoVectors(-direction.normalized(), Eigen::Vector3d::UnitZ())
          .toRotationMatrix();
  return {rotation, Eigen::Vector3d(0, 0, distance_mm)};
}

bool SameBytes(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() &&
         std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
}

// Does the ray through the camera centre meet the face, and where along it (in z)?
std::optional<double> Hit(const Eigen::Vector3d& ray, const std::array<Eigen::Vector3d, 3>& t,
                          double* margin) {
  const double a = ray.dot(t[0].cross(t[1])), b = ray.dot(t[1].cross(t[2])),
               c = ray.dot(t[2].cross(t[0]));
  const double scale = std::abs(a) + std::abs(b) + std::abs(c);
  *margin = std::min({std::abs(a), std::abs(b), std::abs(c)}) / scale;
  if (!((a > 0 && b > 0 && c > 0) || (a < 0 && b < 0 && c < 0))) return std::nullopt;
  const Eigen::Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
  return normal.dot(t[0]) / normal.dot(ray);
}

TEST(Rasterise, TopLeftRuleSharesTheSamplesOfASquareExactly) {
  // Corners on pixel centres: the square [0.5, 4.5) owns its left and top edges only.
  const auto mesh = Flat({{0.5, 0.5}, {4.5, 0.5}, {4.5, 4.5}, {0.5, 4.5}}, {{0, 1, 2}, {0, 2, 3}});
  const cv::Mat mask = RasteriseMask(mesh, {}, FlatCamera(8, 8));
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      EXPECT_EQ(mask.at<std::uint8_t>(y, x), x < 4 && y < 4 ? 255 : 0) << x << ' ' << y;
    }
  }
}

TEST(Rasterise, FacesOfAFanNeitherMissNorShareASample) {
  Rng rng(3);
  for (int trial = 0; trial < 200; ++trial) {
    // A star-shaped polygon around an inner point; snapped so that samples fall on edges.
    const auto snap = [](double v) { return std::round(v * 4) / 4; };
    std::vector<Eigen::Vector2d> points{{snap(rng.Uniform(12, 20)), snap(rng.Uniform(12, 20))}};
    const int n = 12;
    for (int k = 0; k < n; ++k) {
      const double angle = 2 * kPi * k / n, radius = rng.Uniform(4, 11);
      points.push_back({snap(16 + radius * std::cos(angle)), snap(16 + radius * std::sin(angle))});
    }
    std::vector<int> owners(32 * 32, 0);
    std::vector<Face> faces;
    for (std::uint32_t k = 0; k < n; ++k) {
      const Face face{0, 1 + k, 1 + (k + 1) % n};
      const double area = (points[face[1]] - points[0]).x() * (points[face[2]] - points[0]).y() -
                          (points[face[1]] - points[0]).y() * (points[face[2]] - points[0]).x();
      if (area <= 0) break;
      faces.push_back(face);
    }
    if (faces.size() != n) continue;
    cv::Mat whole = RasteriseMask(Flat(points, faces), {}, FlatCamera(32, 32));
    for (const Face& face : faces) {
      const cv::Mat one = RasteriseMask(Flat(points, {face}), {}, FlatCamera(32, 32));
      for (int i = 0; i < 32 * 32; ++i) owners[static_cast<std::size_t>(i)] += one.data[i] != 0;
    }
    for (int i = 0; i < 32 * 32; ++i) {
      ASSERT_EQ(owners[static_cast<std::size_t>(i)], whole.data[i] != 0) << "pixel " << i;
    }
    ASSERT_EQ(
        whole.at<std::uint8_t>(static_cast<int>(points[0].y()), static_cast<int>(points[0].x())),
        255);
  }
}

TEST(Rasterise, AgreesWithRaysOnAClosedMesh) {
  const TriangleMesh mesh = meshes::Icosphere(15, 4);
  const Intrinsics in = Camera(400, 300, 3000);
  const CameraFromModel camera_from_model = LookFrom({0.3, -0.8, 0.4}, 200, 0.7);
  const Raster raster = Rasterise(mesh, camera_from_model, in);
  Rng rng(5);
  int hits = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const int x = static_cast<int>(rng.Below(400)), y = static_cast<int>(rng.Below(300));
    const Eigen::Vector3d ray = RayOfPixel(in, {x + 0.5, y + 0.5});
    double nearest = std::numeric_limits<double>::infinity(), margin = 1;
    int crossings = 0;
    std::int32_t nearest_face = -1;
    for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
      std::array<Eigen::Vector3d, 3> corners;
      for (std::size_t k = 0; k < 3; ++k) {
        corners[k] = camera_from_model * mesh.vertices[mesh.faces[f][k]];
      }
      double face_margin = 1;
      const auto z = Hit(ray, corners, &face_margin);
      if (z) ++crossings;
      if (z && *z < nearest) {
        nearest = *z;
        margin = face_margin;
        nearest_face = static_cast<std::int32_t>(f);
      }
    }
    if (margin < 1e-3) continue;  // too near an edge to say which face
    ASSERT_EQ(crossings % 2, 0);
    ASSERT_EQ(raster.face.at<std::int32_t>(y, x), nearest_face);
    if (crossings == 0) continue;
    ++hits;
    EXPECT_NEAR(raster.depth_mm.at<float>(y, x), nearest, 2e-3);
  }
  EXPECT_GT(hits, 50);
}

TEST(Rasterise, NoHolesInsideAClosedMesh) {
  const TriangleMesh mesh = meshes::Icosphere(15, 5);
  const Intrinsics in = Camera(600, 600, 7000);
  const CameraFromModel camera_from_model = LookFrom({1, 2, 3}, 300, 0);
  const cv::Mat mask = RasteriseMask(mesh, camera_from_model, in);
  // The chordal error of the mesh stays below 0.06 mm: 1.5 px.
  const double radius_px = 7000 * 15 / std::sqrt(300.0 * 300 - 15 * 15);
  for (int y = 0; y < in.h; ++y) {
    for (int x = 0; x < in.w; ++x) {
      const double r = std::hypot(x + 0.5 - in.cx, y + 0.5 - in.cy);
      if (r < radius_px - 1.5) {
        ASSERT_EQ(mask.at<std::uint8_t>(y, x), 255) << x << ' ' << y;
      }
      if (r > radius_px) {
        ASSERT_EQ(mask.at<std::uint8_t>(y, x), 0) << x << ' ' << y;
      }
    }
  }
}

TEST(Rasterise, DepthOfATiltedPlaneIsExact) {
  const Intrinsics in = Camera(320, 240, 900);
  TriangleMesh mesh;
  mesh.vertices = {{-60, -60, 240}, {60, -60, 300}, {60, 60, 320}, {-60, 60, 260}};
  mesh.faces = {{0, 1, 2}, {0, 2, 3}};
  const Raster raster = Rasterise(mesh, {}, in);
  const Eigen::Vector3d normal =
      (mesh.vertices[1] - mesh.vertices[0]).cross(mesh.vertices[2] - mesh.vertices[0]);
  ASSERT_NEAR(normal.dot(mesh.vertices[3] - mesh.vertices[0]), 0, 1e-9);
  int seen = 0;
  for (int y = 0; y < in.h; ++y) {
    for (int x = 0; x < in.w; ++x) {
      if (raster.face.at<std::int32_t>(y, x) < 0) continue;
      ++seen;
      const Eigen::Vector3d ray = RayOfPixel(in, {x + 0.5, y + 0.5});
      EXPECT_NEAR(raster.depth_mm.at<float>(y, x), normal.dot(mesh.vertices[0]) / normal.dot(ray),
                  2e-4);
    }
  }
  EXPECT_GT(seen, 20000);
}

TEST(Rasterise, AppliesLensDistortionAtTheVertices) {
  Intrinsics in = Camera(640, 480, 800);
  in.k1 = -0.15;
  in.k2 = 0.03;
  in.p1 = 0.002;
  in.p2 = -0.001;
  // A grid of small faces at one depth; each pixel must show the cell its own ray meets.
  const int n = 120;
  const double pitch_mm = 5, z = 1000;
  TriangleMesh mesh;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      mesh.vertices.push_back({(i - n / 2) * pitch_mm, (j - n / 2) * pitch_mm, z});
    }
  }
  const auto id = [&](int i, int j) { return static_cast<std::uint32_t>(j * (n + 1) + i); };
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      mesh.faces.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
      mesh.faces.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
    }
  }
  const Raster raster = Rasterise(mesh, {}, in);
  int checked = 0;
  for (int y = 10; y < in.h; y += 7) {
    for (int x = 10; x < in.w; x += 7) {
      const Eigen::Vector3d p = z * RayOfPixel(in, {x + 0.5, y + 0.5});
      const double u = p.x() / pitch_mm + n / 2, v = p.y() / pitch_mm + n / 2;
      if (u < 1 || v < 1 || u > n - 1 || v > n - 1) continue;
      const double fu = u - std::floor(u), fv = v - std::floor(v);
      if (std::min({fu, fv, 1 - fu, 1 - fv, std::abs(fu - fv)}) < 0.02) continue;
      const int cell = static_cast<int>(v) * n + static_cast<int>(u);
      EXPECT_EQ(raster.face.at<std::int32_t>(y, x), 2 * cell + (fv > fu ? 1 : 0));
      ++checked;
    }
  }
  EXPECT_GT(checked, 2000);
}

TEST(Rasterise, ClipsWhatReachesBehindTheCamera) {
  // A strip from far ahead to far behind, 10 mm below the camera: covers all below the horizon of
  // its far end.
  TriangleMesh mesh;
  mesh.vertices = {{-1e6, 10, -500}, {1e6, 10, -500}, {1e6, 10, 1e5}, {-1e6, 10, 1e5}};
  mesh.faces = {{0, 1, 2}, {0, 2, 3}};
  const Intrinsics in = Camera(64, 64, 100);
  const Raster raster = Rasterise(mesh, {}, in);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const double slope = (y + 0.5 - 32) / 100;
      const double expected = slope > 0 ? 10 / slope : std::numeric_limits<double>::infinity();
      if (!(slope > 0)) {
        ASSERT_TRUE(std::isinf(raster.depth_mm.at<float>(y, x)));
      } else {
        ASSERT_NEAR(raster.depth_mm.at<float>(y, x) / expected, 1, 1e-3) << x << ' ' << y;
      }
    }
  }
}

TEST(Rasterise, CoverageOfAStraightEdgeIsWithinOneSample) {
  Rng rng(11);
  const int samples = 4;
  for (int trial = 0; trial < 300; ++trial) {
    // A half plane through a random point of the picture at a random angle.
    const double angle = rng.Uniform(0, 2 * kPi);
    const Eigen::Vector2d along(std::cos(angle), std::sin(angle)), inward(-along.y(), along.x());
    const Eigen::Vector2d p(rng.Uniform(6, 10), rng.Uniform(6, 10));
    const auto mesh = Flat({p - 60 * along, p + 60 * along, p + 60 * along + 60 * inward,
                            p - 60 * along + 60 * inward},
                           {{0, 1, 2}, {0, 2, 3}});
    const cv::Mat coverage = RasteriseCoverage(mesh, {}, FlatCamera(16, 16), samples);
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 16; ++x) {
        // The exact share by cutting the pixel's square with the line.
        std::vector<Eigen::Vector2d> square{{x, y}, {x + 1, y}, {x + 1, y + 1}, {x, y + 1}}, cut;
        for (std::size_t k = 0; k < 4; ++k) {
          const auto &a = square[k], &b = square[(k + 1) % 4];
          const double da = (a - p).dot(inward), db = (b - p).dot(inward);
          if (da >= 0) cut.push_back(a);
          if ((da >= 0) != (db >= 0)) cut.push_back(a + (b - a) * da / (da - db));
        }
        double area = 0;
        for (std::size_t k = 1; k + 1 < cut.size(); ++k) {
          const Eigen::Vector2d u = cut[k] - cut[0], v = cut[k + 1] - cut[0];
          area += 0.5 * (u.x() * v.y() - u.y() * v.x());
        }
        ASSERT_NEAR(coverage.at<std::uint8_t>(y, x) / 255.0, area, 1.0 / samples)
            << x << ' ' << y << " angle " << angle;
      }
    }
  }
}

TEST(Rasterise, CoverageOfAnUprightEdgeIsFine) {
  for (double share : {0.1, 0.37, 0.5, 0.81}) {
    const auto mesh =
        Flat({{4 + share, -9}, {4 + share, 30}, {-9, 30}, {-9, -9}}, {{0, 1, 2}, {0, 2, 3}});
    const cv::Mat coverage = RasteriseCoverage(mesh, {}, FlatCamera(8, 8), 4);
    EXPECT_NEAR(coverage.at<std::uint8_t>(3, 4) / 255.0, share, 0.5 / 16 + 0.003);
    const auto lying =
        Flat({{-9, 4 + share}, {30, 4 + share}, {30, -9}, {-9, -9}}, {{0, 1, 2}, {0, 2, 3}});
    EXPECT_NEAR(RasteriseCoverage(lying, {}, FlatCamera(8, 8), 4).at<std::uint8_t>(4, 3) / 255.0,
                share, 0.5 / 16 + 0.003);
  }
}

TEST(Rasterise, SameBytesForAnyNumberOfThreads) {
  const TriangleMesh mesh = meshes::Icosphere(15, 5);
  Intrinsics in = Camera(500, 400, 5000);
  in.k1 = 0.1;
  const CameraFromModel camera_from_model = LookFrom({-1, 0.4, 0.2}, 250, 1.1);
  Raster one, two;
  cv::Mat coverage_one, coverage_two;
  {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    one = Rasterise(mesh, camera_from_model, in);
    coverage_one = RasteriseCoverage(mesh, camera_from_model, in, 3);
  }
  {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
    two = Rasterise(mesh, camera_from_model, in);
    coverage_two = RasteriseCoverage(mesh, camera_from_model, in, 3);
  }
  EXPECT_TRUE(SameBytes(one.depth_mm, two.depth_mm));
  EXPECT_TRUE(SameBytes(one.face, two.face));
  EXPECT_TRUE(SameBytes(coverage_one, coverage_two));
}

TEST(Rasterise, EmptyMeshShowsNothing) {
  const Raster raster = Rasterise({}, {}, Camera(20, 10, 10));
  EXPECT_EQ(cv::countNonZero(raster.face != -1), 0);
  EXPECT_EQ(cv::countNonZero(RasteriseCoverage({}, {}, Camera(20, 10, 10), 2)), 0);
}

}  // namespace
}  // namespace scan
