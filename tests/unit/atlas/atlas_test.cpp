#include "reconstruction/atlas/atlas.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <limits>
#include <opencv2/core.hpp>

#include "drivers/base/rng.h"
#include "reconstruction/atlas/texel_map.h"
#include "reconstruction/mesh/mesh_io.h"
#include "tests/support/meshes.h"

namespace scan {
namespace {

double DoubleUvArea(const AtlasMesh& atlas, std::size_t f) {
  const Face& face = atlas.mesh.faces[f];
  const Eigen::Vector2d a = atlas.uv[face[1]] - atlas.uv[face[0]];
  const Eigen::Vector2d b = atlas.uv[face[2]] - atlas.uv[face[0]];
  return a.x() * b.y() - a.y() * b.x();
}

double DoubleArea(const TriangleMesh& mesh, std::size_t f) {
  const Eigen::Vector3d& a = mesh.vertices[mesh.faces[f][0]];
  return (mesh.vertices[mesh.faces[f][1]] - a).cross(mesh.vertices[mesh.faces[f][2]] - a).norm();
}

// Every corner shows the vertex of the input's face, in the picture.
void ExpectSameSurface(const TriangleMesh& mesh, const AtlasMesh& atlas) {
  ASSERT_EQ(atlas.mesh.faces.size(), mesh.faces.size());
  ASSERT_EQ(atlas.chart.size(), mesh.faces.size());
  ASSERT_EQ(atlas.uv.size(), atlas.mesh.vertices.size());
  ASSERT_EQ(atlas.uv.size(), atlas.source_vertex.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = atlas.mesh.faces[f][k];
      ASSERT_LT(v, atlas.uv.size());
      ASSERT_EQ(atlas.source_vertex[v], mesh.faces[f][k]);
      ASSERT_EQ(atlas.mesh.vertices[v], mesh.vertices[mesh.faces[f][k]]);
      ASSERT_GE(atlas.uv[v].minCoeff(), 0);
      ASSERT_LE(atlas.uv[v].maxCoeff(), 1);
    }
}

// Rasterises the faces: no texel centre lies well inside two of them, and texels of two charts stay
// `padding_px` apart.
void ExpectApart(const AtlasMesh& atlas, int size_px, int padding_px) {
  cv::Mat owner(size_px, size_px, CV_32S, cv::Scalar(-1));
  int doubly = 0;
  for (std::size_t f = 0; f < atlas.mesh.faces.size(); ++f) {
    Eigen::Vector2d p[3];
    for (std::size_t k = 0; k < 3; ++k) p[k] = atlas.uv[atlas.mesh.faces[f][k]] * size_px;
    const double double_area = DoubleUvArea(atlas, f) * size_px * size_px;
    if (std::abs(double_area) < 1e-9) continue;
    const auto [x0, x1] = std::minmax({p[0].x(), p[1].x(), p[2].x()});
    const auto [y0, y1] = std::minmax({p[0].y(), p[1].y(), p[2].y()});
    for (int y = static_cast<int>(y0); y <= std::min(size_px - 1, static_cast<int>(y1)); ++y)
      for (int x = static_cast<int>(x0); x <= std::min(size_px - 1, static_cast<int>(x1)); ++x) {
        const Eigen::Vector2d q(x + 0.5, y + 0.5);
        double least = 1;
        for (int k = 0; k < 3; ++k) {
          const Eigen::Vector2d e = p[(k + 1) % 3] - p[k], r = q - p[k];
          least = std::min(least, (e.x() * r.y() - e.y() * r.x()) / double_area);
        }
        if (least <= 1e-9) continue;
        auto& seen = owner.at<std::int32_t>(y, x);
        if (seen >= 0) ++doubly;
        seen = static_cast<std::int32_t>(atlas.chart[f]);
      }
  }
  EXPECT_EQ(doubly, 0);
  int close = 0;
  for (int y = 0; y < size_px; ++y)
    for (int x = 0; x < size_px; ++x) {
      const std::int32_t here = owner.at<std::int32_t>(y, x);
      if (here < 0) continue;
      for (int dy = 0; dy <= padding_px; ++dy)
        for (int dx = -padding_px; dx <= padding_px; ++dx) {
          if (dx * dx + dy * dy > padding_px * padding_px) continue;
          if (x + dx < 0 || x + dx >= size_px || y + dy >= size_px) continue;
          const std::int32_t there = owner.at<std::int32_t>(y + dy, x + dx);
          close += there >= 0 && there != here;
        }
    }
  EXPECT_EQ(close, 0);
}

AtlasResult ExpectGoodAtlas(const TriangleMesh& mesh, const AtlasOptions& options) {
  auto made = MakeAtlas(mesh, options);
  EXPECT_TRUE(made) << ToString(made.error());
  if (!made) return {};
  ExpectSameSurface(mesh, made->atlas);
  ExpectApart(made->atlas, options.size_px, options.padding_px);
  std::size_t without_area = 0;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    without_area += std::abs(DoubleUvArea(made->atlas, f)) == 0;
  EXPECT_EQ(without_area, made->report.degenerate_faces);
  EXPECT_GE(made->report.stretch_l2, 0.999);
  EXPECT_LE(made->report.texel_usage, 1);
  return std::move(*made);
}

AtlasOptions Small() {
  AtlasOptions options;
  options.size_px = 512;
  return options;
}

TEST(Atlas, BoxIsUnfoldedWithoutStretch) {
  const auto made = ExpectGoodAtlas(meshes::Box({0, 0, 0}, {1, 2, 3}), Small());
  EXPECT_LE(made.report.charts, 6u);
  EXPECT_NEAR(made.report.stretch_max, 1, 1e-6);
  EXPECT_GT(made.report.texel_usage, 0.4);
  EXPECT_EQ(made.report.degenerate_faces, 0u);
}

TEST(Atlas, SphereHasFewChartsAndLittleStretch) {
  const auto made = ExpectGoodAtlas(meshes::Icosphere(10, 4), Small());
  EXPECT_LE(made.report.charts, 20u);
  EXPECT_LT(made.report.stretch_p99, 1.2);
  EXPECT_GT(made.report.texel_usage, 0.45);  // padding weighs in a small picture
}

TEST(Atlas, ClosedSurfacesWithHandles) {
  ExpectGoodAtlas(meshes::Torus(10, 3, 60, 30), Small());
  const auto gyroid = ExpectGoodAtlas(meshes::Gyroid(10, 9, 18), Small());
  EXPECT_LT(gyroid.report.stretch_p99, 2.5);
}

TEST(Atlas, ThinLegsAndOpenSurfaces) {
  const auto leg = ExpectGoodAtlas(meshes::Cylinder(0.5, 10, 16, 60), Small());
  EXPECT_LE(leg.report.charts, 8u);
  ExpectGoodAtlas(meshes::OpenCylinder(2, 10, 30, 30), Small());
}

TEST(Atlas, NoisySurface) {
  TriangleMesh mesh = meshes::Icosphere(10, 4);
  Rng rng(1);
  for (auto& v : mesh.vertices) v *= 1 + 0.01 * rng.Normal();
  const auto made = ExpectGoodAtlas(mesh, Small());
  EXPECT_LT(made.report.charts, 100u);
}

TEST(Atlas, TexelDensityIsTheSameOverTheSurface) {
  const TriangleMesh mesh =
      meshes::Joined(meshes::Icosphere(10, 3), meshes::Box({20, 0, 0}, {24, 4, 4}));
  const auto made = ExpectGoodAtlas(mesh, Small());
  std::vector<double> surface(made.report.charts, 0), picture(made.report.charts, 0);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    surface[made.atlas.chart[f]] += DoubleArea(mesh, f);
    picture[made.atlas.chart[f]] += std::abs(DoubleUvArea(made.atlas, f));
  }
  const double density = made.report.texels_per_mm / 512;
  for (std::size_t c = 0; c < surface.size(); ++c)
    EXPECT_NEAR(picture[c] / surface[c], density * density, 1e-6 * density * density);
}

TEST(Atlas, PictureShowsTheOutsideUnmirrored) {
  const TriangleMesh mesh = meshes::Icosphere(10, 2);
  const auto made = ExpectGoodAtlas(mesh, Small());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    EXPECT_LT(DoubleUvArea(made.atlas, f), 0);  // v runs down
}

TEST(Atlas, MoebiusBand) {
  TriangleMesh band = meshes::Grid(40, 4, false, false, [](double u, double v) {
    const double a = 2 * kPi * u, w = 2 * (v - 0.5);
    return Eigen::Vector3d((5 + w * std::cos(a / 2)) * std::cos(a),
                           (5 + w * std::cos(a / 2)) * std::sin(a), w * std::sin(a / 2));
  });
  for (Face& face : band.faces)  // the last column is the first one turned over
    for (std::uint32_t& v : face)
      if (v % 41 == 40) v = (4 - v / 41) * 41;
  ExpectGoodAtlas(band, Small());
}

TEST(Atlas, BadMeshesOfEveryKind) {
  TriangleMesh mesh = meshes::Icosphere(1, 2);
  Rng rng(3);
  for (Face& face : mesh.faces)
    if (rng.Below(2)) std::swap(face[0], face[1]);  // inconsistent
  mesh.faces.resize(mesh.faces.size() - 20);        // open
  mesh.faces.push_back(mesh.faces[5]);              // double
  mesh.faces.push_back({0, 0, 1});                  // degenerate
  mesh.faces.push_back({7, 7, 7});
  mesh.vertices.push_back(mesh.vertices[3]);
  mesh.faces.push_back({3, 8, static_cast<std::uint32_t>(mesh.vertices.size() - 1)});
  mesh.vertices.push_back({5, 5, 5});  // fin: a third face at an edge, and a lonely vertex
  mesh.faces.push_back(
      {mesh.faces[0][0], mesh.faces[0][1], static_cast<std::uint32_t>(mesh.vertices.size() - 1)});
  mesh.vertices.push_back({9, 9, 9});
  const auto made = ExpectGoodAtlas(mesh, Small());
  EXPECT_EQ(made.report.degenerate_faces, 3u);
}

TEST(Atlas, RandomSoupNeverCrashes) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Rng rng(seed);
    TriangleMesh mesh;
    for (int v = 0; v < 20; ++v)
      mesh.vertices.emplace_back(rng.Uniform(), rng.Uniform(), rng.Uniform());
    for (int f = 0; f < 60; ++f) {
      Face face{};
      for (auto& corner : face) corner = static_cast<std::uint32_t>(rng.Below(20));
      mesh.faces.push_back(face);
    }
    ExpectGoodAtlas(mesh, Small());
  }
}

TEST(Atlas, ArapStretchesLessThanLscm) {
  AtlasOptions options = Small();
  const TriangleMesh mesh = meshes::Icosphere(10, 3);
  const double lscm = ExpectGoodAtlas(mesh, options).report.stretch_l2;
  options.method = UnfoldMethod::arap;
  EXPECT_LE(ExpectGoodAtlas(mesh, options).report.stretch_l2, lscm + 1e-3);
}

TEST(Atlas, SameBytesForAnyNumberOfThreads) {
  const TriangleMesh mesh = meshes::Gyroid(10, 9, 14);
  const auto many = MakeAtlas(mesh, Small());
  oneapi::tbb::global_control one(oneapi::tbb::global_control::max_allowed_parallelism, 1);
  const auto single = MakeAtlas(mesh, Small());
  ASSERT_TRUE(many && single);
  EXPECT_EQ(many->atlas.uv, single->atlas.uv);
  EXPECT_EQ(many->atlas.chart, single->atlas.chart);
  EXPECT_EQ(many->atlas.mesh.faces, single->atlas.mesh.faces);
}

TEST(Atlas, EveryChartOwnsATexelAndSeamsAreLinked) {
  const auto made = ExpectGoodAtlas(meshes::Icosphere(10, 3), Small());
  const TexelMap map = MakeTexelMap(made.atlas, 512, 2);
  std::vector<int> texels(made.report.charts, 0);
  for (int y = 0; y < 512; ++y)
    for (int x = 0; x < 512; ++x)
      if (map.kind.at<std::uint8_t>(y, x) == 1)
        ++texels[made.atlas.chart[static_cast<std::size_t>(map.face.at<std::int32_t>(y, x))]];
  for (const int count : texels) EXPECT_GT(count, 0);
  const double texel_mm = 1 / made.report.texels_per_mm;
  // About two texels of seam a texel of length; both ends close together on the surface.
  EXPECT_GT(static_cast<double>(map.seam_links.size()), made.report.seam_length_mm / texel_mm);
  for (const SeamLink& link : map.seam_links) {
    const auto a = SurfacePoint(made.atlas, map, link.a % 512, link.a / 512);
    const auto b = SurfacePoint(made.atlas, map, link.b % 512, link.b / 512);
    EXPECT_LT((a - b).norm(), 5 * texel_mm);
  }
}

TEST(Atlas, BadRequests) {
  const TriangleMesh good = meshes::Box({0, 0, 0}, {1, 1, 1});
  const auto expect_bad = [](const TriangleMesh& mesh, const AtlasOptions& options) {
    const auto made = MakeAtlas(mesh, options);
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().kind, ErrorKind::bad_input);
    EXPECT_FALSE(made.error().mend.empty());
  };
  AtlasOptions options;
  options.size_px = 10;
  expect_bad(good, options);
  options = {};
  options.padding_px = -1;
  expect_bad(good, options);
  options = {};
  options.max_stretch = std::numeric_limits<double>::quiet_NaN();
  expect_bad(good, options);
  expect_bad({}, {});
  TriangleMesh flat = good;
  for (auto& v : flat.vertices) v.setZero();
  expect_bad(flat, {});
  TriangleMesh broken = good;
  broken.vertices[0].x() = std::numeric_limits<double>::quiet_NaN();
  expect_bad(broken, {});
  TriangleMesh crowd;  // more separate pieces than a small picture has room for
  for (int i = 0; i < 3000; ++i)
    crowd = meshes::Joined(std::move(crowd), meshes::Box(Eigen::Vector3d::Constant(2.0 * i),
                                                         Eigen::Vector3d::Constant(2.0 * i + 1)));
  options = {};
  options.size_px = 64;
  expect_bad(crowd, options);
}

TEST(Atlas, IsCancelled) {
  std::stop_source source;
  source.request_stop();
  const auto made = MakeAtlas(meshes::Icosphere(1, 3), {}, {}, source.get_token());
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().kind, ErrorKind::cancelled);
}

TEST(Atlas, RealCoarseScan) {
  const std::filesystem::path path =
      SCAN_SOURCE_DIR "/../shared/data/squirrel_turntable/mesh_mm.ply";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "shared data is absent";
  const auto mesh = ReadMesh(path);
  ASSERT_TRUE(mesh);
  const auto made = ExpectGoodAtlas(*mesh, Small());
  EXPECT_LT(made.report.charts, 60u);
  EXPECT_GT(made.report.texel_usage, 0.4);
}

}  // namespace
}  // namespace scan
