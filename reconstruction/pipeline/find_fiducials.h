// Beads of one session: from the CT or a file, and in every photograph.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <stop_token>
#include <vector>

#include "acquisition/session/photo_set.h"
#include "drivers/base/progress.h"
#include "drivers/base/result.h"
#include "reconstruction/fiducials/bead.h"
#include "reconstruction/volume/volume.h"

namespace scan {

struct FiducialOptions {
  std::optional<double> bead_mm;               // diameter of balls to be looked for in the volume
  std::filesystem::path beads;                 // or: a file that WriteBeads wrote
  std::optional<Eigen::Vector3d> bead_colour;  // linear-light RGB

  bool wanted() const { return bead_mm || !beads.empty() || bead_colour; }
};

// Both the beads of the CT and their colour. `volume`: where no file of beads is given. Errors:
// bad_input where one of them is missing or both a diameter and a file are given; those of
// FindBeads and ReadBeads; bad_input for a photograph that cannot be read; cancelled. Thread
// contract: pure but for reading; parallel inside.
Result<BeadFindings> FindFiducials(const FiducialOptions& options, const Volume* volume,
                                   const PhotoSet& photos, const ProgressFn& progress,
                                   std::stop_token stop);

// JSON, schema scanstation.beads/1: model frame, mm. Errors of reading: bad_input with file and
// field.
Status WriteBeads(const std::filesystem::path& path, const std::vector<Bead>& beads);
Result<std::vector<Bead>> ReadBeads(const std::filesystem::path& path);

}  // namespace scan
