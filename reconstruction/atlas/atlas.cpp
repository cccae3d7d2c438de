#include "reconstruction/atlas/atlas.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include "reconstruction/atlas/chart_growth.h"
#include "reconstruction/atlas/chart_merge.h"
#include "reconstruction/atlas/chart_mesh.h"
#include "reconstruction/atlas/chart_quality.h"
#include "reconstruction/atlas/pack.h"
#include "reconstruction/atlas/relax.h"
#include "reconstruction/atlas/unfold.h"

namespace scan {
namespace {

constexpr std::uint32_t kNoVertex = ~0u;
constexpr double kStretchQuantile = 0.01;  // the worst percent of a chart's area

constexpr double kMostWasted = 0.02;
// Of the surface: what a chart may stretch at will, pits that no photograph shows.
constexpr double kSlackShare = 5e-5;
constexpr int kRelaxRounds = 8;

using FaceSet = std::vector<std::uint32_t>;

Status CheckRequest(const TriangleMesh& mesh, const AtlasOptions& options) {
  const auto refuse = [](const char* field, const char* range) -> Status {
    return BadInput("atlas option out of range", field, std::string("choose one in ") + range);
  };
  if (options.size_px < 64 || options.size_px > 16384) return refuse("size_px", "[64, 16384]");
  if (options.padding_px < 0 || options.padding_px > 64) return refuse("padding_px", "[0, 64]");
  if (!(options.max_stretch > 1)) return refuse("max_stretch", "(1, inf)");
  for (const Face& face : mesh.faces)
    for (const std::uint32_t v : face)
      if (v >= mesh.vertices.size() || !mesh.vertices[v].allFinite())
        return BadInput("a face names a vertex that is absent, NaN or infinite", "mesh",
                        "repair the mesh first");
  return {};
}

// Whether the chart's uv may be used; brought to the area of the surface.
bool IsGood(ChartMesh& chart, const AtlasOptions& options, double slack_mm2) {
  if (CountFlipped(chart) > 0) {
    Untangle(chart);
    if (CountFlipped(chart) > 0) return false;
  }
  if (!ScaleToTrueArea(chart) || BorderCrosses(chart)) return false;
  const double slack = slack_mm2 / SurfaceArea(chart.mesh);
  if (WastedShare(chart, options.max_stretch) > std::max(kMostWasted, slack)) return false;
  return StretchQuantile(StretchOf(chart), std::max(kStretchQuantile, slack)) <=
         options.max_stretch;
}

// True when the chart is unfolded without fault.
bool UnfoldWell(ChartMesh& chart, const AtlasOptions& options, double slack_mm2) {
  if (!Unfold(chart, options.method)) {
    if (!chart.disk || chart.faces.size() > 8) return false;
    ProjectToPlane(chart);
  }
  return IsGood(chart, options, slack_mm2);
}

// A conformal map trades size for angles without bound: where it fails, one nearer to an isometry
// may do. Not before charts are halved, which mends with less stretch what bends at one place.
bool UnfoldOrRelax(ChartMesh& chart, const AtlasOptions& options, double slack_mm2) {
  if (UnfoldWell(chart, options, slack_mm2)) return true;
  return !chart.uv.empty() && Relax(chart, kRelaxRounds) && IsGood(chart, options, slack_mm2);
}

// A single face always unfolds: its own shape.
void UnfoldFace(ChartMesh& chart) {
  ProjectToPlane(chart);
  ScaleToTrueArea(chart);
}

double SlackOf(const SurfaceGraph& graph) {
  return kSlackShare * std::accumulate(graph.area.begin(), graph.area.end(), 0.0);
}

// Unfolds all charts, halving those that fail until they do not.
Result<std::vector<ChartMesh>> UnfoldAll(const TriangleMesh& mesh, const SurfaceGraph& graph,
                                         std::vector<FaceSet> pending, const AtlasOptions& options,
                                         const ProgressFn& progress, const std::stop_token& stop) {
  const double slack_mm2 = SlackOf(graph);
  std::vector<ChartMesh> done;
  std::size_t faces_done = 0;
  while (!pending.empty()) {
    if (stop.stop_requested()) return Cancelled("atlas unfolding");
    Report(progress, "unfold",
           static_cast<double>(faces_done) / static_cast<double>(mesh.faces.size()));
    std::vector<ChartMesh> tried(pending.size());
    std::vector<char> good(pending.size(), 0);
    tbb::parallel_for(std::size_t{0}, pending.size(), [&](std::size_t c) {
      if (stop.stop_requested()) return;
      tried[c] = MakeChartMesh(mesh, graph, pending[c]);
      good[c] = UnfoldWell(tried[c], options, slack_mm2);
      if (!good[c] && pending[c].size() == 1) {
        UnfoldFace(tried[c]);
        good[c] = 1;
      }
    });
    if (stop.stop_requested()) return Cancelled("atlas unfolding");
    std::vector<FaceSet> next;
    for (std::size_t c = 0; c < pending.size(); ++c) {
      if (good[c]) {
        faces_done += tried[c].faces.size();
        done.push_back(std::move(tried[c]));
      } else {
        for (FaceSet& half : Bisect(graph, pending[c])) next.push_back(std::move(half));
      }
    }
    pending = std::move(next);
  }
  return done;
}

// Faces without an area share one point of a chart that touches them, else of the first chart.
void PlaceDegenerateFaces(const TriangleMesh& mesh, const SurfaceGraph& graph, AtlasMesh& atlas) {
  std::vector<std::uint32_t> host(mesh.vertices.size(), kNoVertex);  // an atlas vertex at each vertex
  for (std::uint32_t v = 0; v < atlas.source_vertex.size(); ++v)
    if (host[atlas.source_vertex[v]] == kNoVertex) host[atlas.source_vertex[v]] = v;
  std::vector<std::uint32_t> chart_of_vertex(atlas.source_vertex.size(), 0);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    if (!graph.degenerate[f])
      for (const std::uint32_t v : atlas.mesh.faces[f]) chart_of_vertex[v] = atlas.chart[f];
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    if (!graph.degenerate[f]) continue;
    std::uint32_t at = 0;
    for (std::size_t k = 3; k-- > 0;)
      if (host[mesh.faces[f][k]] != kNoVertex) at = host[mesh.faces[f][k]];
    atlas.chart[f] = chart_of_vertex[at];
    for (std::size_t k = 0; k < 3; ++k) {
      atlas.mesh.faces[f][k] = static_cast<std::uint32_t>(atlas.uv.size());
      atlas.mesh.vertices.push_back(mesh.vertices[mesh.faces[f][k]]);
      atlas.source_vertex.push_back(mesh.faces[f][k]);
      atlas.uv.push_back(atlas.uv[at]);
    }
  }
}

AtlasMesh Assemble(const TriangleMesh& mesh, const SurfaceGraph& graph,
                   const std::vector<ChartMesh>& charts) {
  AtlasMesh atlas;
  atlas.mesh.faces.resize(mesh.faces.size());
  atlas.chart.assign(mesh.faces.size(), 0);
  for (std::size_t c = 0; c < charts.size(); ++c) {
    const ChartMesh& chart = charts[c];
    const auto first = static_cast<std::uint32_t>(atlas.uv.size());
    for (std::size_t v = 0; v < chart.uv.size(); ++v) {
      atlas.uv.push_back(chart.uv[v].cwiseMax(0.0).cwiseMin(1.0));
      atlas.mesh.vertices.push_back(chart.mesh.vertices[v]);
      atlas.source_vertex.push_back(chart.source_vertex[v]);
    }
    for (std::size_t i = 0; i < chart.faces.size(); ++i) {
      const std::uint32_t f = chart.faces[i];
      Face face = chart.mesh.faces[i];
      if (graph.flipped[f]) std::swap(face[1], face[2]);  // as the input had it
      atlas.mesh.faces[f] = {face[0] + first, face[1] + first, face[2] + first};
      atlas.chart[f] = static_cast<std::uint32_t>(c);
    }
  }
  PlaceDegenerateFaces(mesh, graph, atlas);
  return atlas;
}

AtlasReport Measure(const TriangleMesh& mesh, const SurfaceGraph& graph,
                    const std::vector<ChartMesh>& charts, const AtlasMesh& atlas) {
  AtlasReport report;
  report.charts = charts.size();
  report.degenerate_faces =
      static_cast<std::size_t>(std::count(graph.degenerate.begin(), graph.degenerate.end(), 1));
  std::vector<FaceStretch> all;
  double area = 0, sum = 0;
  for (const ChartMesh& chart : charts) {  // still in mm
    const auto stretch = StretchOf(chart);
    for (const FaceStretch& s : stretch) {
      area += s.area;
      sum += s.area * 0.5 * (s.largest * s.largest + s.smallest * s.smallest);
      report.stretch_max = std::max(report.stretch_max, s.largest);
    }
    all.insert(all.end(), stretch.begin(), stretch.end());
  }
  report.stretch_l2 = std::sqrt(sum / area);
  report.stretch_median = StretchQuantile(all, 0.5);
  report.stretch_p95 = StretchQuantile(all, 0.05);
  report.stretch_p99 = StretchQuantile(std::move(all), kStretchQuantile);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t g = graph.links[f][k].face;
      if (g < static_cast<std::int32_t>(f) ||
          atlas.chart[f] == atlas.chart[static_cast<std::size_t>(g)])
        continue;
      report.seam_length_mm +=
          (mesh.vertices[mesh.faces[f][k]] - mesh.vertices[mesh.faces[f][(k + 1) % 3]]).norm();
    }
  }
  return report;
}

double BorderLength(const std::vector<ChartMesh>& charts) {
  double length = 0;
  for (const ChartMesh& chart : charts)
    for (const auto& [from, to] : chart.border) length += (chart.uv[from] - chart.uv[to]).norm();
  return length;
}

}  // namespace

Result<AtlasResult> MakeAtlas(const TriangleMesh& mesh, const AtlasOptions& options,
                              const ProgressFn& progress, std::stop_token stop) {
  SCAN_CHECK(CheckRequest(mesh, options));
  const SurfaceGraph graph = MakeSurfaceGraph(mesh);
  if (std::find(graph.degenerate.begin(), graph.degenerate.end(), 0) == graph.degenerate.end())
    return BadInput("mesh has no face with an area", "mesh", "give a surface mesh");
  SCAN_TRY(auto face_sets, GrowCharts(mesh, graph, progress, stop));
  SCAN_TRY(auto charts, UnfoldAll(mesh, graph, std::move(face_sets), options, progress, stop));
  const double slack_mm2 = SlackOf(graph);
  const auto unfold = [&](ChartMesh& chart) { return UnfoldOrRelax(chart, options, slack_mm2); };
  SCAN_CHECK(MergeSmallCharts(mesh, graph, unfold, charts, progress, stop));
  std::sort(charts.begin(), charts.end(), [](const ChartMesh& a, const ChartMesh& b) {
    return a.faces.front() < b.faces.front();
  });
  std::vector<ChartMesh> in_mm = charts;
  SCAN_TRY(const double texels_per_mm,
           PackCharts(charts, {options.size_px, options.padding_px}, progress, stop));
  AtlasResult result;
  result.atlas = Assemble(mesh, graph, charts);
  result.report = Measure(mesh, graph, in_mm, result.atlas);
  result.report.texels_per_mm = texels_per_mm;
  const double texels = static_cast<double>(options.size_px) * options.size_px;
  double area_mm2 = 0;
  for (const double area : graph.area) area_mm2 += area;
  result.report.padding_usage =
      BorderLength(in_mm) * texels_per_mm * 0.5 * options.padding_px / texels;
  result.report.texel_usage = area_mm2 * texels_per_mm * texels_per_mm / texels;
  Report(progress, "pack", 1);
  return result;
}

}  // namespace scan
