#include "reconstruction/atlas/unfold.h"

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_parameterization/ARAP_parameterizer_3.h>
#include <CGAL/Surface_mesh_parameterization/LSCM_parameterizer_3.h>
#include <CGAL/Surface_mesh_parameterization/Two_vertices_parameterizer_3.h>

#include <Eigen/Geometry>
#include <cmath>
#include <exception>

namespace scan {
namespace {

namespace param = CGAL::Surface_mesh_parameterization;
using Kernel = CGAL::Simple_cartesian<double>;
using CgalMesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Vertex = CgalMesh::Vertex_index;
using UvMap = CgalMesh::Property_map<Vertex, Kernel::Point_2>;
using TwoVertices = param::Two_vertices_parameterizer_3<CgalMesh>;
using Lscm = param::LSCM_parameterizer_3<CgalMesh, TwoVertices>;

double DoubleArea(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

// Lengths are brought near 1 for the solver.
bool Build(const ChartMesh& chart, CgalMesh& mesh) {
  const BoundingBox bounds = BoundsOf(chart.mesh);
  const double size = bounds.diagonal();
  if (!(size > 0)) return false;
  for (const Eigen::Vector3d& v : chart.mesh.vertices) {
    const Eigen::Vector3d p = (v - bounds.centre()) / size;
    mesh.add_vertex(Kernel::Point_3(p.x(), p.y(), p.z()));
  }
  for (const Face& f : chart.mesh.faces)
    if (mesh.add_face(Vertex(f[0]), Vertex(f[1]), Vertex(f[2])) == CgalMesh::null_face())
      return false;
  return true;
}

// Two border vertices far from each other.
std::array<Vertex, 2> FarBorderVertices(const ChartMesh& chart) {
  std::uint32_t a = chart.border.front()[0], b = a;
  for (int round = 0; round < 3; ++round) {
    double farthest = -1;
    for (const auto& edge : chart.border) {
      const double distance = (chart.mesh.vertices[edge[0]] - chart.mesh.vertices[a]).squaredNorm();
      if (distance > farthest) {
        farthest = distance;
        b = edge[0];
      }
    }
    std::swap(a, b);
  }
  return {Vertex(a), Vertex(b)};
}

param::Error_code Solve(const ChartMesh& chart, UnfoldMethod method, CgalMesh& mesh, UvMap uv) {
  const auto fixed = mesh.add_property_map<Vertex, bool>("v:fixed", false).first;
  auto index = mesh.add_property_map<Vertex, int>("v:unknown", 0).first;
  int next = 0;
  for (const Vertex v : mesh.vertices()) index[v] = next++;
  CgalMesh::Halfedge_index border;
  for (const auto h : mesh.halfedges())
    if (mesh.is_border(h)) {
      border = h;
      break;
    }
  if (method == UnfoldMethod::arap) {
    param::ARAP_parameterizer_3<CgalMesh> arap;
    return arap.parameterize(mesh, border, uv, index, fixed);
  }
  const auto ends = FarBorderVertices(chart);
  Lscm lscm(TwoVertices(ends[0], ends[1]));
  return lscm.parameterize(mesh, border, uv, index, fixed);
}

}  // namespace

bool ScaleToTrueArea(ChartMesh& chart) {
  double area = 0;
  for (const Face& f : chart.mesh.faces)
    area += 0.5 * DoubleArea(chart.uv[f[0]], chart.uv[f[1]], chart.uv[f[2]]);
  const double scale = std::sqrt(SurfaceArea(chart.mesh) / area);
  if (!(area > 0) || !std::isfinite(scale)) return false;
  for (Eigen::Vector2d& uv : chart.uv) uv *= scale;
  return true;
}

void ProjectToPlane(ChartMesh& chart) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (const Face& f : chart.mesh.faces) {
    const Eigen::Vector3d& a = chart.mesh.vertices[f[0]];
    normal += (chart.mesh.vertices[f[1]] - a).cross(chart.mesh.vertices[f[2]] - a);
  }
  if (!(normal.norm() > 0)) normal = Eigen::Vector3d::UnitZ();
  normal.normalize();
  const Eigen::Vector3d x = normal.unitOrthogonal(), y = normal.cross(x);
  chart.uv.clear();
  for (const Eigen::Vector3d& v : chart.mesh.vertices) {
    const Eigen::Vector3d p = v - chart.mesh.vertices.front();
    chart.uv.emplace_back(x.dot(p), y.dot(p));
  }
}

bool Unfold(ChartMesh& chart, UnfoldMethod method) {
  chart.uv.clear();
  if (!chart.disk) return false;
  if (chart.faces.size() == 1) {
    ProjectToPlane(chart);
    return true;
  }
  try {
    CgalMesh mesh;
    if (!Build(chart, mesh)) return false;
    UvMap uv = mesh.add_property_map<Vertex, Kernel::Point_2>("v:uv", Kernel::Point_2(0, 0)).first;
    if (Solve(chart, method, mesh, uv) != param::OK) return false;
    for (const Vertex v : mesh.vertices()) {
      chart.uv.emplace_back(uv[v].x(), uv[v].y());
      if (!chart.uv.back().allFinite()) {
        chart.uv.clear();
        return false;
      }
    }
  } catch (const std::exception&) {  // CGAL's own checks; the caller splits the chart
    chart.uv.clear();
    return false;
  }
  if (!ScaleToTrueArea(chart)) {
    chart.uv.clear();
    return false;
  }
  return true;
}

}  // namespace scan
