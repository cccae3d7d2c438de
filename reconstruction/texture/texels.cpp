#include "reconstruction/texture/texels.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "reconstruction/texture/texture.h"

namespace scan {
namespace {

// Vertex normals of the surface before it was cut along the seams.
std::vector<Eigen::Vector3d> SmoothNormals(const AtlasMesh& atlas) {
  const TriangleMesh& mesh = atlas.mesh;
  std::uint32_t highest = 0;
  for (const std::uint32_t v : atlas.source_vertex) highest = std::max(highest, v);
  std::vector<Eigen::Vector3d> sum(highest + 1, Eigen::Vector3d::Zero());
  for (const Face& f : mesh.faces) {
    const Eigen::Vector3d n = (mesh.vertices[f[1]] - mesh.vertices[f[0]])
                                  .cross(mesh.vertices[f[2]] - mesh.vertices[f[0]]);
    for (const std::uint32_t v : f) sum[atlas.source_vertex[v]] += n;
  }
  std::vector<Eigen::Vector3d> normals(mesh.vertices.size());
  for (std::size_t v = 0; v < normals.size(); ++v) {
    normals[v] = sum[atlas.source_vertex[v]].normalized();
  }
  return normals;
}

// Surface area that one texel of each face stands for.
std::vector<double> AreaPerTexel(const AtlasMesh& atlas, int size_px) {
  std::vector<double> area(atlas.mesh.faces.size());
  for (std::size_t f = 0; f < area.size(); ++f) {
    const Face& face = atlas.mesh.faces[f];
    const auto& v = atlas.mesh.vertices;
    const double surface = 0.5 * (v[face[1]] - v[face[0]]).cross(v[face[2]] - v[face[0]]).norm();
    const Eigen::Vector2d a = atlas.uv[face[1]] - atlas.uv[face[0]];
    const Eigen::Vector2d b = atlas.uv[face[2]] - atlas.uv[face[0]];
    const double texels = 0.5 * std::abs(a.x() * b.y() - a.y() * b.x()) * size_px * size_px;
    area[f] = surface / std::max(texels, 1.0);
  }
  return area;
}

void SetNeighbours(const AtlasMesh& atlas, const TexelMap& map, Texels& out) {
  const int n = map.size_px;
  std::vector<std::int32_t> index(static_cast<std::size_t>(n) * n, -1);
  for (std::size_t i = 0; i < out.size(); ++i) index[out.place[i]] = static_cast<std::int32_t>(i);
  out.beside.resize(out.size());
  auto chart_of = [&](int place) { return atlas.chart[map.face.at<int>(place / n, place % n)]; };
  tbb::parallel_for(std::size_t{0}, out.size(), [&](std::size_t i) {
    const int place = out.place[i], x = place % n, y = place / n;
    const std::array<int, 4> to = {x + 1 < n ? place + 1 : -1, y + 1 < n ? place + n : -1,
                                   x > 0 ? place - 1 : -1, y > 0 ? place - n : -1};
    for (int k = 0; k < 4; ++k) {
      const bool joined = to[k] >= 0 && index[to[k]] >= 0 && chart_of(to[k]) == chart_of(place);
      out.beside[i][k] = joined ? index[to[k]] : -1;
    }
  });
  out.link_begin.assign(out.size() + 1, 0);
  auto good = [&](const SeamLink& s) { return index[s.a] >= 0 && index[s.b] >= 0; };
  for (const SeamLink& s : map.seam_links) {
    if (!good(s)) continue;
    ++out.link_begin[index[s.a] + 1];
    ++out.link_begin[index[s.b] + 1];
  }
  for (std::size_t i = 0; i < out.size(); ++i) out.link_begin[i + 1] += out.link_begin[i];
  out.link.resize(out.link_begin.back());
  std::vector<std::int32_t> next(out.link_begin.begin(), out.link_begin.end() - 1);
  for (const SeamLink& s : map.seam_links) {
    if (!good(s)) continue;
    out.link[next[index[s.a]]++] = index[s.b];
    out.link[next[index[s.b]]++] = index[s.a];
  }
}

}  // namespace

Texels MakeTexels(const AtlasMesh& atlas, const TexelMap& map) {
  Texels out;
  out.size_px = map.size_px;
  for (int y = 0; y < map.size_px; ++y) {
    for (int x = 0; x < map.size_px; ++x) {
      if (map.kind.at<uchar>(y, x) == static_cast<uchar>(TexelKind::inside)) {
        out.place.push_back(y * map.size_px + x);
      }
    }
  }
  const std::vector<Eigen::Vector3d> normals = SmoothNormals(atlas);
  const std::vector<double> area = AreaPerTexel(atlas, map.size_px);
  out.position.resize(out.size());
  out.normal.resize(out.size());
  out.area_mm2.resize(out.size());
  out.side_mm.resize(out.size());
  tbb::parallel_for(std::size_t{0}, out.size(), [&](std::size_t i) {
    const int x = out.place[i] % map.size_px, y = out.place[i] / map.size_px;
    const int f = map.face.at<int>(y, x);
    const Face& face = atlas.mesh.faces[f];
    const cv::Vec2f w = map.barycentric.at<cv::Vec2f>(y, x);
    const Eigen::Vector3d n =
        (1 - w[0] - w[1]) * normals[face[0]] + w[0] * normals[face[1]] + w[1] * normals[face[2]];
    out.position[i] = SurfacePoint(atlas, map, x, y).cast<float>();
    out.normal[i] = n.normalized().cast<float>();
    out.area_mm2[i] = static_cast<float>(area[f]);
    out.side_mm[i] = static_cast<float>(std::sqrt(area[f]));
  });
  SetNeighbours(atlas, map, out);
  return out;
}

namespace {

struct CodeTables {
  std::vector<float> linear_of_code;  // 65536
  std::vector<float> code_of_linear;  // 4097, by the square root of linear light
  CodeTables() : linear_of_code(65536), code_of_linear(4097) {
    for (int i = 0; i < 65536; ++i) {
      const double c = i / 65535.0;
      linear_of_code[i] =
          static_cast<float>(c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4));
    }
    for (int i = 0; i <= 4096; ++i) {
      const double l = (i / 4096.0) * (i / 4096.0);
      const double c = l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1 / 2.4) - 0.055;
      code_of_linear[i] = static_cast<float>(65535 * c);
    }
  }
};

const CodeTables& Tables() {
  static const CodeTables tables;  // constant; made on first use by one thread
  return tables;
}

}  // namespace

Colour16 CodesOfLinear(const cv::Vec3f& linear) {
  const std::vector<float>& table = Tables().code_of_linear;
  Colour16 codes;
  for (int c = 0; c < 3; ++c) {
    const float s = 4096 * std::sqrt(std::clamp(linear[c], 0.f, 1.f));
    const int i = std::min(4095, static_cast<int>(s));
    codes[c] = static_cast<std::uint16_t>(table[i] + (s - i) * (table[i + 1] - table[i]) + 0.5f);
  }
  return codes;
}

cv::Vec3f LinearOfCodes(const Colour16& codes) {
  const std::vector<float>& table = Tables().linear_of_code;
  return {table[codes[0]], table[codes[1]], table[codes[2]]};
}

Layer MakeLayer(std::size_t texels) {
  return {std::vector<Colour16>(texels, Colour16(0, 0, 0)), std::vector<float>(texels, 0.f),
          std::vector<std::uint16_t>(texels, kNoView), std::vector<std::uint16_t>(texels, 0)};
}

}  // namespace scan
