// Error against noise and against the logged poses' sigma, as a table and a plot.
#pragma once

#include <filesystem>
#include <string>

#include "firmware-host/cli/command.h"
#include "reconstruction/evaluate/pose_sweep.h"

namespace scan {

enum class SweepOf { noise, prior };

// Errors: those of the solves; failed when `plot` (PNG; empty: none) cannot be written.
Result<CommandOutput> RunSweep(const PoseTrial& trial, SweepOf what, const SweepOptions& options,
                               const std::filesystem::path& plot, const CliContext& context);

}  // namespace scan
