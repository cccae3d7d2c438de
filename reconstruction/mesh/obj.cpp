// Wavefront OBJ: vertices, texture coordinates, polygons and groups; the rest is read over.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>

#include "reconstruction/mesh/formats.h"
#include "reconstruction/mesh/text_scanner.h"

namespace scan {
namespace {

constexpr std::uint32_t kAbsent = ~0u;

struct Corner {
  std::uint32_t vertex = kAbsent;
  std::uint32_t uv = kAbsent;
};

struct ObjData {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector2d> uvs;
  std::vector<std::array<Corner, 3>> faces;
  std::vector<std::uint32_t> chart;  // per face, from "g chart_N"; kAbsent without one
};

tl::unexpected<Error> MalformedObj(const std::string& what, const std::string& where) {
  return BadInput("malformed OBJ: " + what, where, "write the mesh again as OBJ or binary PLY");
}

template <int Size>
Result<Eigen::Matrix<double, Size, 1>> ParseVector(std::string_view line,
                                                   const std::string& where) {
  Eigen::Matrix<double, Size, 1> vector;
  for (int axis = 0; axis < Size; ++axis) {
    const auto value = ParseNumber<double>(TakeWord(line));
    if (!value || !std::isfinite(*value))
      return MalformedObj("a coordinate is missing, NaN or infinite", where);
    vector[axis] = *value;
  }
  return vector;
}

// OBJ counts from 1; negative indices count back from the latest. Those beyond what was read so far
// are checked at the end.
Result<std::uint32_t> ParseIndex(std::string_view word, std::size_t known,
                                 const std::string& where) {
  const auto index = ParseNumber<std::int64_t>(word);
  if (!index || *index == 0)
    return MalformedObj(fmt::format("index \"{}\"", word.substr(0, 40)), where);
  const std::int64_t from_zero =
      *index > 0 ? *index - 1 : static_cast<std::int64_t>(known) + *index;
  if (from_zero < 0 || from_zero >= static_cast<std::int64_t>(kAbsent))
    return MalformedObj(fmt::format("index {} after {} entries", *index, known), where);
  return static_cast<std::uint32_t>(from_zero);
}

// "v", "v/vt", "v//vn" or "v/vt/vn".
Result<Corner> ParseCorner(std::string_view word, const ObjData& data, const std::string& where) {
  Corner corner;
  const std::size_t slash = word.find('/');
  SCAN_TRY(corner.vertex, ParseIndex(word.substr(0, slash), data.vertices.size(), where));
  if (slash == std::string_view::npos) return corner;
  std::string_view rest = word.substr(slash + 1);
  rest = rest.substr(0, rest.find('/'));
  if (rest.empty()) return corner;
  SCAN_TRY(corner.uv, ParseIndex(rest, data.uvs.size(), where));
  return corner;
}

Status ParseFace(std::string_view line, std::uint32_t chart, ObjData& data,
                 const std::string& where) {
  std::vector<Corner> corners;
  for (std::string_view word = TakeWord(line); !word.empty(); word = TakeWord(line)) {
    if (word.front() == '#') break;
    SCAN_TRY(const Corner corner, ParseCorner(word, data, where));
    corners.push_back(corner);
  }
  if (corners.size() < 3) return MalformedObj("a face with fewer than three corners", where);
  for (std::size_t k = 2; k < corners.size(); ++k) {
    data.faces.push_back({corners[0], corners[k - 1], corners[k]});
    data.chart.push_back(chart);
  }
  return {};
}

std::uint32_t ChartOfGroup(std::string_view line) {
  const std::string_view name = TakeWord(line);
  constexpr std::string_view kPrefix = "chart_";
  if (!name.starts_with(kPrefix)) return kAbsent;
  return ParseNumber<std::uint32_t>(name.substr(kPrefix.size())).value_or(kAbsent);
}

Result<ObjData> ParseLines(std::string_view text, const std::string& file) {
  ObjData data;
  std::uint32_t chart = kAbsent;
  std::string joined;
  for (std::size_t line_number = 1; !text.empty(); ++line_number) {
    std::string_view line = TakeLine(text);
    const std::string where = fmt::format("{}:{}", file, line_number);
    if (!line.empty() && line.back() == '\\') {  // goes on in the next line
      joined.clear();
      while (!line.empty() && line.back() == '\\') {
        joined += line.substr(0, line.size() - 1);
        joined += ' ';
        line = TakeLine(text);
        ++line_number;
      }
      joined += line;
      line = joined;
    }
    const std::string_view key = TakeWord(line);
    if (key == "v") {
      SCAN_TRY(const Eigen::Vector3d v, ParseVector<3>(line, where));
      data.vertices.push_back(v);
    } else if (key == "vt") {
      SCAN_TRY(const Eigen::Vector2d uv, ParseVector<2>(line, where));
      data.uvs.push_back(uv);
    } else if (key == "f") {
      SCAN_CHECK(ParseFace(line, chart, data, where));
    } else if (key == "g") {
      chart = ChartOfGroup(line);
    }
  }
  return data;
}

TriangleMesh MeshOf(const ObjData& data) {
  TriangleMesh mesh;
  mesh.vertices = data.vertices;
  mesh.faces.reserve(data.faces.size());
  for (const auto& face : data.faces)
    mesh.faces.push_back({face[0].vertex, face[1].vertex, face[2].vertex});
  return mesh;
}

Status CheckUvs(const ObjData& data, const std::string& file) {
  constexpr double kSlack = 1e-6;  // what writing with few digits can add
  for (std::size_t f = 0; f < data.faces.size(); ++f) {
    const std::string where = fmt::format("{}: face {}", file, f);
    for (const Corner& corner : data.faces[f]) {
      if (corner.uv >= data.uvs.size())
        return BadInput("a face has no texture coordinates", where,
                        "make an atlas of the mesh with `scanstation atlas`");
      const Eigen::Vector2d& uv = data.uvs[corner.uv];
      if (uv.minCoeff() < -kSlack || uv.maxCoeff() > 1 + kSlack)
        return BadInput("texture coordinates outside the unit square", where,
                        "make an atlas of the mesh with `scanstation atlas`");
    }
  }
  return {};
}

// Charts of a file without chart groups: faces that hang together through equal corners.
std::vector<std::uint32_t> ChartsByUvIslands(const ObjData& data) {
  std::vector<std::uint32_t> parent(data.uvs.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto find = [&](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const auto& face : data.faces) {
    for (int k = 1; k < 3; ++k) {
      const std::uint32_t a = find(face[0].uv), b = find(face[k].uv);
      parent[std::max(a, b)] = std::min(a, b);
    }
  }
  std::map<std::uint32_t, std::uint32_t> chart_of_root;
  std::vector<std::uint32_t> chart;
  for (const auto& face : data.faces)
    chart.push_back(
        chart_of_root.try_emplace(find(face[0].uv), chart_of_root.size()).first->second);
  return chart;
}

// One vertex per (texture coordinate, vertex, chart), in the order of the texture coordinates, so
// that what FormatAtlasObj wrote comes back in the same order.
AtlasMesh Assemble(const ObjData& data, std::vector<std::uint32_t> chart) {
  using Key = std::array<std::uint32_t, 3>;
  std::vector<Key> keys;
  keys.reserve(3 * data.faces.size());
  for (std::size_t f = 0; f < data.faces.size(); ++f)
    for (const Corner& corner : data.faces[f]) keys.push_back({corner.uv, corner.vertex, chart[f]});
  std::vector<Key> distinct = keys;
  std::sort(distinct.begin(), distinct.end());
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());

  AtlasMesh atlas;
  for (const Key& key : distinct) {
    const Eigen::Vector2d& uv = data.uvs[key[0]];
    atlas.uv.emplace_back(std::clamp(uv.x(), 0.0, 1.0), std::clamp(1 - uv.y(), 0.0, 1.0));
    atlas.mesh.vertices.push_back(data.vertices[key[1]]);
    atlas.source_vertex.push_back(key[1]);
  }
  for (std::size_t f = 0; f < data.faces.size(); ++f) {
    Face face{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto at = std::lower_bound(distinct.begin(), distinct.end(), keys[3 * f + k]);
      face[k] = static_cast<std::uint32_t>(at - distinct.begin());
    }
    atlas.mesh.faces.push_back(face);
  }
  atlas.chart = std::move(chart);
  return atlas;
}

// The points of the unsplit surface that the atlas uses, numbered upwards without gaps.
struct SourcePoints {
  TriangleMesh mesh;
  std::vector<std::uint32_t> of_vertex;  // per vertex of the atlas
};

SourcePoints CollectSourcePoints(const AtlasMesh& atlas) {
  SourcePoints points;
  std::vector<std::uint32_t> ids = atlas.source_vertex;
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  points.mesh.vertices.resize(ids.size());
  for (std::size_t v = 0; v < atlas.source_vertex.size(); ++v) {
    const auto at = std::lower_bound(ids.begin(), ids.end(), atlas.source_vertex[v]) - ids.begin();
    points.of_vertex.push_back(static_cast<std::uint32_t>(at));
    points.mesh.vertices[static_cast<std::size_t>(at)] = atlas.mesh.vertices[v];
  }
  for (const Face& face : atlas.mesh.faces)
    points.mesh.faces.push_back(
        {points.of_vertex[face[0]], points.of_vertex[face[1]], points.of_vertex[face[2]]});
  return points;
}

}  // namespace

Result<TriangleMesh> ParseObj(std::string_view text, const std::string& where) {
  SCAN_TRY(const ObjData data, ParseLines(text, where));
  TriangleMesh mesh = MeshOf(data);
  SCAN_CHECK(CheckMesh(mesh, where));
  return mesh;
}

Result<AtlasMesh> ParseAtlasObj(std::string_view text, const std::string& where) {
  SCAN_TRY(const ObjData data, ParseLines(text, where));
  SCAN_CHECK(CheckMesh(MeshOf(data), where));
  SCAN_CHECK(CheckUvs(data, where));
  const bool has_charts =
      std::find(data.chart.begin(), data.chart.end(), kAbsent) == data.chart.end();
  return Assemble(data, has_charts ? data.chart : ChartsByUvIslands(data));
}

std::string FormatAtlasObj(const AtlasMesh& atlas, const std::string& material_file) {
  const SourcePoints points = CollectSourcePoints(atlas);
  std::string text = "# units mm\n";
  auto out = std::back_inserter(text);
  if (!material_file.empty()) fmt::format_to(out, "mtllib {}\n", material_file);
  // The shortest digits that give the same float back.
  const auto number = [](double value) { return static_cast<float>(value); };
  for (const Eigen::Vector3d& v : points.mesh.vertices)
    fmt::format_to(out, "v {} {} {}\n", number(v.x()), number(v.y()), number(v.z()));
  for (const Eigen::Vector3d& n : VertexNormals(points.mesh))
    fmt::format_to(out, "vn {:.4f} {:.4f} {:.4f}\n", n.x(), n.y(), n.z());
  for (const Eigen::Vector2d& uv : atlas.uv)
    fmt::format_to(out, "vt {} {}\n", number(uv.x()), number(1 - uv.y()));
  if (!material_file.empty()) text += "usemtl albedo\n";
  for (std::size_t f = 0; f < atlas.mesh.faces.size(); ++f) {
    if (f == 0 || atlas.chart[f] != atlas.chart[f - 1])
      fmt::format_to(out, "g chart_{}\n", atlas.chart[f]);
    text += "f";
    for (const std::uint32_t v : atlas.mesh.faces[f])
      fmt::format_to(out, " {0}/{1}/{0}", points.of_vertex[v] + 1, v + 1);
    text += "\n";
  }
  return text;
}

std::string FormatMaterial(const std::string& albedo_file) {
  return "newmtl albedo\nKa 1 1 1\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd " + albedo_file + "\n";
}

}  // namespace scan
