// How far solved poses are from the simulated world's truth.
#pragma once

#include <filesystem>
#include <vector>

#include "acquisition/session/photo_set.h"
#include "drivers/base/result.h"
#include "reconstruction/pose/poses.h"
#include "reconstruction/pose/score.h"

namespace scan {

// The truth of every photo of a session, in the order of its photos, from the file that
// `scanstationd --truth` wrote; frames are matched by camera and sensor sequence.
// Errors: bad_input when the file or a frame is missing.
Result<std::vector<PoseOf>> ReadTruth(const std::filesystem::path& truth,
                                      const std::filesystem::path& session, const PhotoSet& photos);

}  // namespace scan
