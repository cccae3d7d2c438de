// PLY (binary or ASCII) and OBJ in, binary PLY out.
#pragma once

#include <filesystem>

#include "drivers/base/result.h"
#include "reconstruction/mesh/atlas_mesh.h"
#include "reconstruction/mesh/mesh.h"

namespace scan {

// Reads PLY or OBJ by extension. Polygons are fanned into triangles.
// Errors: bad_input for unreadable, truncated or malformed files, no faces, indices out of range,
// NaN or infinite vertices.
Result<TriangleMesh> ReadMesh(const std::filesystem::path& path);

Status WritePly(const std::filesystem::path& path, const TriangleMesh& mesh);

// OBJ with texture coordinates, a MTL that names `albedo_file` where that is not empty, and a
// sidecar-free chart id as OBJ group (g chart_N).
Status WriteAtlasObj(const std::filesystem::path& path, const AtlasMesh& atlas,
                     const std::string& albedo_file);

// Errors as ReadMesh, and bad_input for faces without texture coordinates.
Result<AtlasMesh> ReadAtlasObj(const std::filesystem::path& path);

}  // namespace scan
