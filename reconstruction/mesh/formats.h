// The two file formats behind mesh_io.h, on bytes in memory.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/base/result.h"
#include "reconstruction/mesh/atlas_mesh.h"

namespace scan {

// `where` is the file's name for error messages.
Result<TriangleMesh> ParsePly(std::span<const std::byte> bytes, const std::string& where);
std::vector<std::byte> FormatPly(const TriangleMesh& mesh);

Result<TriangleMesh> ParseObj(std::string_view text, const std::string& where);
Result<AtlasMesh> ParseAtlasObj(std::string_view text, const std::string& where);
// `material_file` empty: no material.
std::string FormatAtlasObj(const AtlasMesh& atlas, const std::string& material_file);
std::string FormatMaterial(const std::string& albedo_file);

// bad_input unless there are vertices, all finite, and faces, all of whose indices exist.
Status CheckMesh(const TriangleMesh& mesh, const std::string& where);

}  // namespace scan
