// Plots of how a joint solve went and what it rests on.
#pragma once

#include <string>

#include "reconstruction/pose/diagnostics.h"
#include "reconstruction/report/plot.h"

namespace scan {

// Largest motion, match window and residual scale over the iterations; no point without steps.
Plot ConvergencePlot(const PoseDiagnostics& diagnostics);

// Cost over the iterations.
Plot CostPlot(const PoseDiagnostics& diagnostics);

// Eigenvalues of all parameters' information in order, the prior's 1 as a guide.
Plot SpectrumPlot(const Spectrum& solve);

// Eigenvalues of each mounting's placing, each labelled with what it mostly is.
Plot PlacingPlot(const std::vector<Spectrum>& placings);

// Directions of which the evidence says less than the prior: eigenvalues below 2.
std::size_t HardlyInformed(const Spectrum& solve);

// The parameters that the smallest `count` eigenvalues mostly are; empty when there are none.
std::string LeastDetermined(const Spectrum& spectrum, std::size_t count);

}  // namespace scan
