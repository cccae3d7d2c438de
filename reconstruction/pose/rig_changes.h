// What happened to the rig between two photographs: lost steps, a specimen that was pushed, one
// view that stands alone. Told from the pose that each view finds by itself, so that the others
// need not give way first.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "reconstruction/pose/joint_refine.h"

namespace scan {

struct RigChange {
  enum class Kind {
    steps_lost,      // since `view` the turntable's angle is off by a constant
    specimen_moved,  // since `view` the specimen stands elsewhere on the table
    view_alone,      // only this view disagrees with the log and with the others
  };
  Kind kind = Kind::view_alone;
  int view = 0;     // the first taken after it
  double gain = 0;  // of the log-likelihood
};

struct ChangeOptions {
  // A change is believed when it gains this much, and 2 for each of its degrees of freedom, in
  // units of the scatter that remains, and a share of all that the log leaves unexplained.
  double least_gain = 15;
  double least_share = 0.3;
  // Of what a change of six degrees of freedom gains, one of a single one may leave out.
  double simple_share = 0.02;
  int most = 8;  // changes of one session
  double steps_sigma_rad = 0.3;
};

// Evidence of every view in use, linearised at the pose that its outline alone leads to from the
// pose at `parameters`; at that pose itself where the outline is explained no better by its own: a
// round specimen's outline leads some degrees about its axis, by chance. Parallel inside.
using RigEvidence = std::vector<std::optional<CondensedEvidence>>;
RigEvidence EvidenceOfViewsAlone(const ContourMesh& mesh, const RigModel& rig,
                                 std::span<const PhotoContour> photos, const std::vector<bool>& use,
                                 const RigParameters& parameters, double correlation_px,
                                 const RefineOptions& options);

// The change that explains most of what the rig leaves unexplained; none when no change is
// believed. `cost` is SolveRig's at `parameters`, which are at its minimum. Lagrange-multiplier
// test of each change at each view: exact for small ones. Thread contract: pure.
std::optional<RigChange> MostLikelyChange(const RigModel& rig, const RigEvidence& evidence,
                                          const RigParameters& parameters, double cost,
                                          const ChangeOptions& options);

// Leaves out lost steps from a view on from which the specimen is also found to stand elsewhere:
// its new placing holds the turn too, and nothing tells the two apart.
void RemoveContained(std::vector<RigChange>& changes);

// Finds the changes one after the other, most telling first, and gives the rig what describes each:
// a new offset of the turntable or a new placing. A view that stands alone is only named; it should
// take no further part. `parameters` receives those that the changed rig starts from.
// `names`: of the photographs.
std::vector<RigChange> FindChanges(const ContourMesh& mesh, RigModel& rig,
                                   std::span<const PhotoContour> photos,
                                   const std::vector<bool>& use, const RefineOptions& refine,
                                   double correlation_px, std::span<const std::string> names,
                                   const ChangeOptions& options, RigParameters& parameters);

}  // namespace scan
