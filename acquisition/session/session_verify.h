// Whether a session folder is what its log says.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "drivers/base/progress.h"
#include "drivers/base/result.h"

namespace scan {

struct SessionReport {
  std::vector<Error> problems;     // empty: the session is sound
  std::vector<std::string> notes;  // a torn last line, files that no document names
  std::vector<std::string> views_complete, views_missing;  // of the plan with its extensions
  std::size_t log_documents = 0;
  std::size_t files_checked = 0;
  std::uint64_t bytes_checked = 0;
  bool sound() const { return problems.empty(); }
};

// Checks session.json, the chain of the log, bytes and SHA-256 of every file that a document names
// (void ones too), and the frames against the plan.
// Errors: bad_input for a folder that is no session; damage is in the report.
// Thread contract: pure.
Result<SessionReport> VerifySession(const std::filesystem::path& folder,
                                    const ProgressFn& progress = {});

}  // namespace scan
