// How a joint solve went and what it rests on: for the report, not for the result.
#pragma once

#include <string>
#include <vector>

namespace scan {

// One turn of the outer loop: contours found, matched and condensed, the rig solved.
struct SolveStep {
  double cost = 0;       // at the minimum, 1/2 sum of squares; weights change from step to step
  double moved_px = 0;   // largest motion of any view's surface
  double window_px = 0;  // within which contours were matched
  double residual_px =
      0;                 // robust scale of the residuals that the views agree on, before the solve
  bool restart = false;  // the first after the start or after a change of what is solved
};

// An eigenvalue of an information matrix and the parameter with the largest share in its direction.
struct SpectrumLine {
  double eigenvalue = 0;
  std::string parameter;
  double share = 0;  // squared component of the unit eigenvector, 0..1
};

struct Spectrum {
  std::string of;                   // "solve", or the id of a mounting
  std::vector<SpectrumLine> lines;  // ascending
};

struct PoseDiagnostics {
  std::vector<SolveStep> steps;  // of the solve that was kept; empty where the method has none
  double converged_px = 0;       // the bar for SolveStep::moved_px
  bool converged = false;
  // Of the information of all parameters, each in units of its prior's sigma: 1 is known from the
  // prior alone.
  Spectrum solve;
  // Of each mounting's placing about the specimen's centre, all else marginalised: 1 / mm^2, turns
  // counted as mm at the specimen's radius.
  std::vector<Spectrum> placings;
};

}  // namespace scan
