// Photographs of a coloured specimen on an imperfect rig, its CT and the mesh of it.
#pragma once

#include <memory>
#include <vector>

#include "pose_scene.h"
#include "reconstruction/pose/poses.h"
#include "reconstruction/specimens/specimen.h"
#include "reconstruction/volume/volume.h"
#include "tests/support/temp_folder.h"

namespace scan::test {

struct ColouredScene {
  std::unique_ptr<TempFolder> folder;  // holds the photographs
  Scene scene;
  Volume volume;
  TriangleMesh mesh;  // of the volume
};

// `specimen` on the table, photographs as PNG files with their lighting. `voxel_mm` of the CT; 0:
// none, the mesh is the exact surface.
ColouredScene MakeColouredScene(std::shared_ptr<const Specimen> specimen,
                                const SceneOptions& options, double voxel_mm);

// Poses at the truth but for one turn about the model's z axis, common to all, and one of each view
// (none when empty), the turn reported free.
Poses PosesTurnedBy(const ColouredScene& scene, double common_rad,
                    const std::vector<double>& own_rad);

// Turn of each view about the model's z axis against the truth.
std::vector<double> AzimuthErrors(const ColouredScene& scene, const Poses& poses);

}  // namespace scan::test
