// Volumes out, for the demo's synthetic CT and for tests.
#pragma once

#include <filesystem>

#include "drivers/base/result.h"
#include "reconstruction/volume/volume.h"

namespace scan {

enum class GreyType { uint8, uint16, float32 };

struct WriteVolumeOptions {
  GreyType type = GreyType::uint16;
  bool compressed = true;
};

// Writes .mha or .nrrd by extension; integers are rounded and clamped to the type's range. The file
// appears whole or not at all.
// Errors: bad_input for another extension or an empty volume, failed when it cannot be written.
// Thread contract: pure.
Status WriteVolume(const std::filesystem::path& path, const Volume& volume,
                   const WriteVolumeOptions& options = {});

}  // namespace scan
