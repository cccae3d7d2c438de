// The poses for the tools people already use: nerfstudio and COLMAP.
#pragma once

#include <filesystem>

#include "acquisition/session/photo_set.h"
#include "drivers/base/result.h"
#include "reconstruction/pose/poses.h"

namespace scan {

// FOLDER/transforms.json: camera-to-model matrices, OpenGL axes (x right, y up, z backward), mm;
// one frame for each accepted view, with file_path and mask_path relative to FOLDER.
// Errors: bad_input for a view that names no photograph or lens state; failed from the disk.
Status WriteTransforms(const std::filesystem::path& folder, const Poses& poses,
                       const PhotoSet& photos);

// FOLDER/sparse/0/{cameras,images,points3D}.txt, COLMAP's text form: world = model, mm; camera
// model PINHOLE, OPENCV where distorted, FULL_OPENCV where k3 is not zero; image names are file
// names. Errors: as WriteTransforms.
Status WriteColmap(const std::filesystem::path& folder, const Poses& poses, const PhotoSet& photos);

}  // namespace scan
