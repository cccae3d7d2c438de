#include "reconstruction/atlas/chart_merge.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "reconstruction/atlas/atlas.h"
#include "reconstruction/atlas/chart_picture.h"
#include "reconstruction/atlas/chart_quality.h"
#include "reconstruction/atlas/relax.h"
#include "reconstruction/atlas/unfold.h"
#include "tests/support/meshes.h"

namespace scan {
namespace {

bool UnfoldAny(ChartMesh& chart) { return Unfold(chart, UnfoldMethod::lscm); }

// Every face a chart of its own.
std::vector<ChartMesh> Crumbs(const TriangleMesh& mesh, const SurfaceGraph& graph) {
  std::vector<ChartMesh> charts;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    charts.push_back(MakeChartMesh(mesh, graph, {f}));
    ProjectToPlane(charts.back());
  }
  return charts;
}

TEST(MergeSmallCharts, CrumbsOfAPlaneBecomeFewAndKeepEveryFace) {
  const TriangleMesh plane = meshes::Grid(
      40, 40, false, false, [](double u, double v) { return Eigen::Vector3d(u, v, 0.0); });
  const SurfaceGraph graph = MakeSurfaceGraph(plane);
  std::vector<ChartMesh> charts = Crumbs(plane, graph);
  ASSERT_TRUE(MergeSmallCharts(plane, graph, UnfoldAny, charts, {}, {}));
  EXPECT_LT(charts.size(), 260u);  // each of at least 1/250 of the surface, but for rests
  std::vector<int> seen(plane.faces.size(), 0);
  for (const ChartMesh& chart : charts) {
    EXPECT_TRUE(chart.disk);
    EXPECT_EQ(chart.uv.size(), chart.mesh.vertices.size());
    for (const std::uint32_t f : chart.faces) ++seen[f];
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), std::ssize(seen));
}

TEST(MergeSmallCharts, RefusedChartsStayAsTheyWere) {
  const TriangleMesh box = meshes::Box({0, 0, 0}, {1, 1, 1});
  const SurfaceGraph graph = MakeSurfaceGraph(box);
  std::vector<ChartMesh> charts = Crumbs(box, graph);
  const auto never = [](ChartMesh&) { return false; };
  ASSERT_TRUE(MergeSmallCharts(box, graph, never, charts, {}, {}));
  EXPECT_EQ(charts.size(), 12u);
  std::stop_source stop;
  stop.request_stop();
  const TriangleMesh ball = meshes::Icosphere(1, 3);
  const SurfaceGraph ball_graph = MakeSurfaceGraph(ball);
  charts = Crumbs(ball, ball_graph);
  EXPECT_FALSE(MergeSmallCharts(ball, ball_graph, UnfoldAny, charts, {}, stop.get_token()));
}

TEST(Relax, BringsADevelopableSheetToItsTrueShape) {
  const TriangleMesh sheet = meshes::Grid(30, 10, false, false, [](double u, double v) {
    return Eigen::Vector3d(2 * std::cos(2 * u), 2 * std::sin(2 * u), v);
  });
  const SurfaceGraph graph = MakeSurfaceGraph(sheet);
  std::vector<std::uint32_t> faces(sheet.faces.size());
  std::iota(faces.begin(), faces.end(), 0u);
  ChartMesh chart = MakeChartMesh(sheet, graph, faces);
  ASSERT_TRUE(Unfold(chart, UnfoldMethod::lscm));
  for (Eigen::Vector2d& p : chart.uv) p = Eigen::Vector2d(1.6 * p.x(), p.y() + 0.2 * p.x());
  ASSERT_GT(StretchQuantile(StretchOf(chart), 0.5), 1.01);
  ASSERT_TRUE(Relax(chart, 60));
  EXPECT_EQ(CountFlipped(chart), 0u);
  for (const FaceStretch& s : StretchOf(chart)) {
    EXPECT_NEAR(s.largest, 1, 0.01);
    EXPECT_NEAR(s.smallest, 1, 0.01);
  }
}

// A ball with many narrow pits, as a CT surface has them where pores were.
TEST(Atlas, PitsDoNotShatterTheirCharts) {
  TriangleMesh ball = meshes::Icosphere(10, 4);
  for (Eigen::Vector3d& v : ball.vertices) {
    const Eigen::Vector3d n = v.normalized();
    const double azimuth = std::atan2(n.y(), n.x()), height = 4 * n.z();
    const double off = std::hypot(std::remainder(height, 1.0) / 4,
                                  std::remainder(azimuth, kPi / 6) * std::hypot(n.x(), n.y()));
    if (off < 0.12 && std::abs(n.z()) < 0.8) v *= 1 - 0.15 * (1 - off / 0.12);
  }
  AtlasOptions options;
  options.size_px = 512;
  const auto made = MakeAtlas(ball, options);
  ASSERT_TRUE(made) << ToString(made.error());
  EXPECT_LT(made->report.charts, 120u);
  EXPECT_LT(made->report.stretch_p95, 2.0);
  EXPECT_LE(made->report.stretch_median, made->report.stretch_p95);
  EXPECT_LE(made->report.stretch_p95, made->report.stretch_p99);
  EXPECT_GT(made->report.padding_usage, 0);
  EXPECT_LT(made->report.padding_usage + made->report.texel_usage, 1);
  const cv::Mat picture = ChartPicture(made->atlas, 64);
  EXPECT_EQ(picture.rows, 64);
  EXPECT_GT(picture.cols, 3 * 60);
}

}  // namespace
}  // namespace scan
