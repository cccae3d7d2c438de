// Whether two session folders hold the same bytes.
#pragma once

#include <filesystem>

#include "drivers/base/result.h"

namespace scan {

// Compares session.json, log.jsonl, frames/ and plates/ byte for byte; derived/ can be recomputed
// and is left out. Errors: failed naming the first file (and line of the log) that differs or
// stands on one side alone; bad_input for a folder that cannot be read. Thread contract: pure.
Status CompareSessions(const std::filesystem::path& a, const std::filesystem::path& b);

}  // namespace scan
