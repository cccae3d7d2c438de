#include "reconstruction/mesh/mesh_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "drivers/base/files.h"
#include "reconstruction/mesh/formats.h"

namespace scan {
namespace {

std::string LowerExtension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

}  // namespace

Status CheckMesh(const TriangleMesh& mesh, const std::string& where) {
  if (mesh.faces.empty())
    return BadInput("mesh has no faces", where, "give a surface mesh, not a point cloud");
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!mesh.vertices[v].allFinite())
      return BadInput("vertex is NaN or infinite", fmt::format("{}: vertex {}", where, v),
                      "repair the mesh in the program that wrote it");
  }
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    for (const std::uint32_t v : mesh.faces[f]) {
      if (v >= mesh.vertices.size())
        return BadInput(fmt::format("vertex index {} of {} vertices", v, mesh.vertices.size()),
                        fmt::format("{}: face {}", where, f),
                        "repair the mesh in the program that wrote it");
    }
  }
  return {};
}

Result<TriangleMesh> ReadMesh(const std::filesystem::path& path) {
  const std::string extension = LowerExtension(path);
  if (extension == ".ply") {
    SCAN_TRY(const auto bytes, ReadBinaryFile(path));
    return ParsePly(bytes, path.string());
  }
  if (extension == ".obj") {
    SCAN_TRY(const auto text, ReadTextFile(path));
    return ParseObj(text, path.string());
  }
  return BadInput("unknown mesh format \"" + extension + "\"", path.string(),
                  "convert it to .ply or .obj");
}

Status WritePly(const std::filesystem::path& path, const TriangleMesh& mesh) {
  return WriteFileDurably(path, FormatPly(mesh));
}

Status WriteAtlasObj(const std::filesystem::path& path, const AtlasMesh& atlas,
                     const std::string& albedo_file) {
  if (albedo_file.empty()) return WriteFileDurably(path, FormatAtlasObj(atlas, ""));
  std::filesystem::path material = path;
  material.replace_extension(".mtl");
  SCAN_CHECK(WriteFileDurably(material, FormatMaterial(albedo_file)));
  return WriteFileDurably(path, FormatAtlasObj(atlas, material.filename().string()));
}

Result<AtlasMesh> ReadAtlasObj(const std::filesystem::path& path) {
  if (LowerExtension(path) != ".obj")
    return BadInput("not an OBJ file", path.string(),
                    "give an OBJ with texture coordinates, as `scanstation atlas` writes it");
  SCAN_TRY(const auto text, ReadTextFile(path));
  return ParseAtlasObj(text, path.string());
}

}  // namespace scan
