// The reconstruction in order: the table of contents of this half of the project.
//
//   volume      ReadVolume              file                -> Volume
//   surface     ExtractSurface          Volume              -> TriangleMesh
//   atlas       MakeAtlas               TriangleMesh        -> AtlasMesh
//   masks       MakeMasks               PhotoSet            -> Mask per photograph
//   beads       FindFiducials           Volume, PhotoSet    -> BeadFindings
//   pose        SolveJoint, SolvePaper  mesh, photographs, masks -> Poses
//   appearance  DecideFreeTurns         what silhouettes left free is decided by colour
//   texture     MakeTexture             atlas, photographs, poses, masks -> pictures of the atlas
//   export      WriteGlb
//   report      WriteReport
#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "acquisition/session/photo_set.h"
#include "drivers/base/progress.h"
#include "drivers/base/result.h"
#include "reconstruction/appearance/appearance.h"
#include "reconstruction/atlas/atlas.h"
#include "reconstruction/masks/make_masks.h"
#include "reconstruction/pipeline/find_fiducials.h"
#include "reconstruction/pose/paper/solve_paper.h"
#include "reconstruction/pose/poses.h"
#include "reconstruction/pose/solve_joint.h"
#include "reconstruction/report/report.h"
#include "reconstruction/surface/surface.h"
#include "reconstruction/texture/texture.h"
#include "reconstruction/volume/read_volume.h"

namespace scan {

enum class PoseMethod { joint, paper };

struct StageOptions {
  ReadVolumeOptions volume;
  SurfaceOptions surface;
  AtlasOptions atlas;
  MaskOptions masks;
  std::optional<double> exclude_below_mm;  // above the platter: no evidence, no texture; see
                                           // ExcludeBelow
  FiducialOptions fiducials;
  PoseMethod method = PoseMethod::joint;
  JointOptions joint;
  PaperOptions paper;
  AppearanceOptions appearance;
  TextureOptions texture;
};

struct ReconstructRequest {
  std::filesystem::path session;
  std::filesystem::path volume;  // a CT volume, or
  std::filesystem::path mesh;    // a mesh of it; exactly one of the two
  std::filesystem::path out;     // folder: surface.ply atlas.obj poses/ albedo.png provenance.png
                                 // model.glb report.html; beads.json where asked for
  bool force = false;
  StageOptions options;
};

struct ReconstructResult {
  std::filesystem::path model, report, poses_file;
  PhotoSet photos;
  TriangleMesh surface;
  Poses poses;
  std::vector<AppearanceFinding> turns;  // that silhouettes left free, judged by colour
  std::size_t views_accepted = 0;
  double coverage = 0;  // share of the surface's area that is measured
  std::vector<StageSeconds> stages;
};

// Runs every stage and writes the whole output folder at once.
// Errors: those of the stages; bad_input for the request itself; failed when no view was accepted.
// Thread contract: pure but for the files; parallel inside.
Result<ReconstructResult> Reconstruct(const ReconstructRequest& request,
                                      const ProgressFn& progress = {}, std::stop_token stop = {});

// MakeMasks and then ExcludeBelow. Errors and threads: as these.
Result<std::vector<Mask>> MakeEvidence(const PhotoSet& photos, const StageOptions& options,
                                       const ProgressFn& progress, std::stop_token stop);

// By the method chosen. Errors: those of SolveJoint and SolvePaper; bad_input for beads with the
// paper's. Threads: as these.
Result<Poses> SolvePoses(const TriangleMesh& mesh, const PhotoSet& photos,
                         std::span<const Mask> masks, const StageOptions& options,
                         const ProgressFn& progress, std::stop_token stop);

// poses.json, transforms.json and sparse/0/*.txt in `folder`, as `scanstation pose` writes them.
Status WritePoseFiles(const std::filesystem::path& folder, const Poses& poses,
                      const PhotoSet& photos);

// atlas.obj, albedo.png, provenance.png and model.glb in `folder`.
Status WriteModelFiles(const std::filesystem::path& folder, const AtlasMesh& atlas,
                       const TextureResult& texture, const Poses& poses);

}  // namespace scan
