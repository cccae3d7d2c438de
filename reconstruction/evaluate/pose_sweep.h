// How a solve's errors grow with those of the evidence: outlines that stray, logged poses that are
// off.
#pragma once

#include <cstdint>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "reconstruction/evaluate/drawn_mask.h"
#include "reconstruction/evaluate/pose_trial.h"

namespace scan {

// Moves each photograph's nominal pose by a draw of these standard deviations, about the camera
// centre, and states them of it beside what it stated before. Photographs without a nominal pose
// stay as they are.
void DisplaceLoggedPoses(PoseTrial& trial, const RigidSigma& sigma, std::uint64_t seed);

struct SweepPoint {
  double at = 0;       // px of outline noise; or deg, and as many mm, of the logged poses
  bool priors = true;  // else the logged poses were left aside
  MethodSummary summary;
};

struct SweepOptions {
  DrawnMaskOptions masks;  // the noise's sigma is swept by SweepNoise
  JointOptions joint;      // no_priors is swept
  double wrong_px = 5;
};

// Masks drawn anew with each sigma (px), solved with the logged poses and without.
// Errors: those of SolveJoint. Thread contract: as SolveJoint.
Result<std::vector<SweepPoint>> SweepNoise(const PoseTrial& trial, std::span<const double> sigma_px,
                                           const SweepOptions& options, const ProgressFn& progress,
                                           std::stop_token stop);

// Logged poses displaced by each sigma (deg, and as many mm) and stated to be; the solve without
// them is the same for all.
Result<std::vector<SweepPoint>> SweepPriors(const PoseTrial& trial,
                                            std::span<const double> sigma_deg_and_mm,
                                            const SweepOptions& options, const ProgressFn& progress,
                                            std::stop_token stop);

// The lines of a table for a terminal; `at` names what was swept, with its unit.
std::string TableOf(std::span<const SweepPoint> points, const std::string& at);

}  // namespace scan
