// Turns that silhouettes leave free, decided by colour: of the views against each other where they
// share surface, of all of them against what the CT shows under it.
#pragma once

#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "acquisition/session/photo_set.h"
#include "drivers/base/progress.h"
#include "drivers/base/result.h"
#include "reconstruction/appearance/surface_features.h"
#include "reconstruction/appearance/turn_search.h"
#include "reconstruction/appearance/turning_grid.h"
#include "reconstruction/appearance/view_colours.h"
#include "reconstruction/appearance/view_turns.h"
#include "reconstruction/masks/mask.h"
#include "reconstruction/mesh/mesh.h"
#include "reconstruction/pose/poses.h"
#include "reconstruction/volume/volume.h"

namespace scan {

struct AppearanceOptions {
  bool enabled = true;
  TurningGridOptions grid;
  FeatureOptions features;
  ViewColourOptions colours;
  ViewTurnOptions view_turns;
  TurnSearchOptions search;
  // A view is turned against the others where that is so many of its sigmas.
  double least_view_sigmas = 3;
  double pose_sigma_px = 0.15;     // of the poses but for the turn, full size: it looks like a turn
  int views_alone = 8;             // that are searched each by itself, for comparison
  double alone_agrees_rad = 0.05;  // a view alone finds the turn of all when it is so close
};

// What was found of one free turn.
struct AppearanceFinding {
  FreeDirection direction;           // as it was reported free
  TurnEstimate turn;                 // of all views together
  std::vector<std::size_t> views;    // taking part, by index into Poses::views
  std::vector<ViewTurn> view_turns;  // of each, against the others
  std::vector<bool> corrected;       // of each: its pose was turned by that
  Agreement before, after;     // of the views' colours, each view's own turn left and taken off
  double view_spread_rad = 0;  // RMS of the turns and sigmas that remain between the views
  // A wrong turntable axis: size of the part of the view turns that goes once round with the
  // turntable, and its sigma. 0 without logged angles.
  double once_round_rad = 0, once_round_sigma_rad = 0;
  std::size_t searched_alone = 0, agree_alone = 0;
};

// What the views of one mounting show of its free turn; changes nothing. `volume`: in the model
// frame, or none. Errors: bad_input for a photograph that cannot be read or is of another size than
// its camera says; cancelled. Thread contract: pure but for reading the photographs; parallel
// inside; the same bytes for any number of threads.
Result<AppearanceFinding> FindAppearance(const TriangleMesh& mesh, const Volume* volume,
                                         const PhotoSet& photos, std::span<const Mask> masks,
                                         const Poses& poses, const FreeDirection& direction,
                                         const AppearanceOptions& options = {},
                                         std::stop_token stop = {});

// Turns poses and mounting by what was found, sets their uncertainty along the turn, and takes the
// direction off the free ones where it was decided. Notes say what decided, or why nothing did.
void ApplyAppearance(const TriangleMesh& mesh, const PhotoSet& photos,
                     const AppearanceFinding& finding, const AppearanceOptions& options,
                     Poses& poses);

// Both, for every rotation of a mounting that is free alone: what was found of each. Errors and
// threads: as FindAppearance.
Result<std::vector<AppearanceFinding>> DecideFreeTurns(
    const TriangleMesh& mesh, const Volume* volume, const PhotoSet& photos,
    std::span<const Mask> masks, const AppearanceOptions& options, Poses& poses,
    const ProgressFn& progress = {}, std::stop_token stop = {});

}  // namespace scan
