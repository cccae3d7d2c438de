// Eigenvalues of the information that a joint solve rests on.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "acquisition/session/photo_set.h"
#include "reconstruction/pose/diagnostics.h"
#include "reconstruction/pose/joint_refine.h"
#include "reconstruction/pose/joint_result.h"
#include "reconstruction/pose/rig_solve.h"

namespace scan {

// What each parameter is called in the report, in the order of the layout.
std::vector<std::string> ParameterNames(const PhotoSet& photos, const RigModel& rig,
                                        const RigLayout& layout);

// Of a symmetric matrix; `names` one for each row. Empty when it is not finite.
Spectrum SpectrumOf(const std::string& of, const Eigen::MatrixXd& information,
                    const std::vector<std::string>& names);

// Of all parameters in units of their priors' sigma; empty above 600 of them, where the
// decomposition would take as long as a good part of the solve. Thread contract: pure.
Spectrum SolveSpectrum(const PhotoSet& photos, const RigModel& rig, const RefineResult& fit);

// Of each mounting's placing, views that are mountings of their own left out: the inverse of its
// marginal covariance, turns about the mesh's centre counted as mm at its radius, axes of the
// table.
std::vector<Spectrum> PlacingSpectra(const ContourMesh& mesh, const RigModel& rig,
                                     const RigPosterior& posterior,
                                     const RigParameters& parameters);

}  // namespace scan
