// All photographs of a session solved together with the rig: logged poses as priors, silhouettes as
// evidence, uncertainty reported.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <stop_token>
#include <string>

#include "acquisition/session/photo_set.h"
#include "drivers/base/progress.h"
#include "drivers/base/result.h"
#include "reconstruction/masks/mask.h"
#include "reconstruction/mesh/mesh.h"
#include "reconstruction/pose/acceptance.h"
#include "reconstruction/pose/bead_solve.h"
#include "reconstruction/pose/bent_parts.h"
#include "reconstruction/pose/joint_refine.h"
#include "reconstruction/pose/poses.h"
#include "reconstruction/pose/rig_changes.h"
#include "reconstruction/pose/rig_model.h"
#include "reconstruction/pose/start_search.h"
#include "reconstruction/pose/view_start.h"

namespace scan {

struct JointOptions {
  std::string model;     // the mesh file's name, for the result
  RigPriors rig;         // px of a picture 1848 px wide; scaled to the photos
  RefineOptions refine;  // the same
  AcceptanceOptions acceptance;
  StartOptions start;
  ChangeOptions changes;
  BentPartOptions bent_parts;
  BeadFindings bead_findings;  // none: no beads
  BeadOptions beads;
  ViewStartOptions view_start;  // for photographs without a nominal pose
  bool no_priors = false;       // logged poses are left aside, as if every photograph had none
  // Of this mesh, to share it between calls; else made when needed.
  std::shared_ptr<const ViewSearch> view_search;
  // Known placings by mounting id; the start search runs for the others.
  std::map<std::string, TableFromModel> table_from_model;
};

// Finds camera_from_model of every photograph. Those without a nominal pose are each searched and
// refined alone and join through the model: they share camera, mask bias and CT scale. What such a
// photograph cannot decide between is listed as `alternatives` of its view. What went wrong with
// the rig, with the beads and what was bent since the CT is named in `notes` and allowed for.
// `masks`: one per photo, in order; an empty mask rejects its view. The mesh is in mm, model frame.
// Errors: bad_input for a mesh without faces or with NaN vertices, no photos, a number or size of
// masks that does not match, a list of bead images that does not, no mask with a specimen;
// cancelled. Thread contract: pure; parallel inside; the same bytes for any number of threads.
Result<Poses> SolveJoint(const TriangleMesh& mesh, const PhotoSet& photos,
                         std::span<const Mask> masks, const JointOptions& options,
                         const ProgressFn& progress = {}, std::stop_token stop = {});

}  // namespace scan
