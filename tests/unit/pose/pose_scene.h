// A small synthetic session with known truth: photographs' masks of a mesh on an imperfect rig.
#pragma once

#include <string>
#include <vector>

#include "acquisition/session/photo_set.h"
#include "reconstruction/masks/mask.h"
#include "reconstruction/mesh/mesh.h"
#include "reconstruction/pose/contour_evidence.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan::test {

// What goes wrong with the rig while the log does not notice; -1: never.
struct SceneFaults {
  int steps_lost_from = -1;
  double steps_lost_rad = 0;
  int moved_from = -1;        // the specimen on the table: this motion about its box's centre
  int moved_until = 1 << 30;  // and back again
  Vector6d moved = Vector6d::Zero();
  int resumed_at = -1;  // another reference epoch, logged, with another zero
  double resumed_zero_rad = 0;
  bool sign_inverted = false;
  int turned_over_at = -1;  // another mounting "m1", logged
  TableFromModel turned_over;
};

struct SceneOptions {
  int w = 1848, h = 1224;
  int views = 24;  // over two aims when even
  std::vector<double> elevations_deg{15, 45};
  double focal_mm = 70, sensor_mm = 23.6, radius_mm = 550;
  bool static_errors =
      false;  // focal 0.05 %, principal point 3 px, axis 0.5 deg, aims 0.2 deg 0.5 mm
  double mask_bias_px = 0;
  std::uint64_t seed = 1;
  SceneFaults faults{};
};

// Photographs of 924 x 612.
SceneOptions MediumPhotos(int views, bool static_errors = false);

struct Scene {
  PhotoSet photos;
  std::vector<Mask> masks;
  TableFromModel table_from_model;  // true
  std::vector<CameraFromModel> truth;
  std::vector<Intrinsics> true_intrinsics;  // per photo
};

// Anti-aliased coverage of the mesh, 8 x 8 samples a pixel.
Mask RenderMask(const TriangleMesh& mesh, const CameraFromModel& camera_from_model,
                const Intrinsics& intrinsics);

Scene MakeScene(const TriangleMesh& mesh, const TableFromModel& table_from_model,
                const SceneOptions& options);

// An egg-shaped body with a horn and five unequal legs, 30 mm long: overlapping closed shells. One
// leg may be bent where it leaves the body.
TriangleMesh BugMesh(int subdivisions, double bent_rad = 0);

// The bug from 550 mm in a picture of 924 x 612, no mask bias.
ViewState BugView();

// A closed body of revolution about an axis that is not a coordinate axis; `facets` around.
TriangleMesh RevolutionMesh(int facets, const Eigen::Vector3d& axis);

}  // namespace scan::test
