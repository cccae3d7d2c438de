// Runs the capture again without devices, from a recorded session alone.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "acquisition/runner/runner.h"
#include "acquisition/twins/replay_script.h"

namespace scan {

// The request that the next run of the recording was made with: document, options and the
// operator's recorded answers, to be written to `copy`.
// Errors: bad_input for a session that no capture wrote.
Result<CaptureRequest> RequestOfRecording(const std::shared_ptr<ReplayScript>& script,
                                          const std::filesystem::path& copy);

// Drives RunCapture on replay devices through every run of the recording (a cancelled capture and
// the one that went on with it are two), which writes `copy`. The copy of an undamaged recording is
// the same byte for byte; see CompareSessions. A recording that was cut off without end document
// (power failure) can be followed only to the cut.
// Errors: bad_input for no recording, an existing `copy`; device where the run leaves the
// recording; those of RunCapture.
// Thread contract: pure.
Result<std::vector<CaptureReport>> ReplaySession(const std::filesystem::path& recording,
                                                 const std::filesystem::path& copy,
                                                 CaptureObserver* observer = nullptr);

}  // namespace scan
