// Solved poses beside cameras that others calibrated, in a frame of their own.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "acquisition/session/photo_set.h"
#include "drivers/base/result.h"
#include "reconstruction/masks/mask.h"
#include "reconstruction/mesh/mesh.h"
#include "reconstruction/pose/poses.h"
#include "reconstruction/pose/score.h"

namespace scan {

struct CalibratedCameras {
  Intrinsics intrinsics;
  std::map<std::string, CameraFromModel> views;  // by the photograph's name
};

// {"fx","fy","cx","cy","w","h","views":{NAME: 3 rows of 4}}: OpenCV axes, mm, pixel centres at 0.5.
// Errors: bad_input with file and field.
Result<CalibratedCameras> ReadCalibrated(const std::filesystem::path& path);

// A lens parameter against what it was believed to be.
struct MovedParameter {
  std::string lens, name;
  double moved = 0;  // from the nominal value; relative for fl_rel, else px
  double sigma = 0, prior_sigma = 0;
  double truth = 0;  // calibrated less nominal, same unit
};

// Of the mesh's outline to the photograph's, all views together.
struct OutlineDistances {
  Spread px;            // its size
  double swell_px = 0;  // its median, the photograph's outline outside is positive
  Spread even_px;       // its size less that median: masks cut too wide or too narrow all round
};

struct CalibratedFigures {
  std::size_t views = 0, accepted = 0;
  Spread neighbour_deg;            // rotation between neighbours, solved against calibrated
  Spread aligned_deg;              // every view's rotation, after one rotation of the model frame
  std::optional<double> axis_deg;  // solved against calibrated turntable axis, camera frame; only
                                   // with one aim
  std::vector<MovedParameter> lens;
  OutlineDistances contour;
  OutlineDistances contour_calibrated;  // at the calibrated poses; means something only where their
                                        // model frame is the mesh's
};

// Accepted views that `truth` names are compared, in the order of `photos`. Contour distances are
// along the outline's normal, where the photograph's evidence is; pieces without a partner within
// 25 px count as that. Preconditions: one view and one mask per photo.
// Errors: bad_input when fewer than three views can be compared or the calibration is of pictures
// of another size. Thread contract: pure; parallel inside.
Result<CalibratedFigures> CompareWithCalibrated(const Poses& poses, const CalibratedCameras& truth,
                                                const TriangleMesh& mesh, const PhotoSet& photos,
                                                std::span<const Mask> masks);

}  // namespace scan
