#include "acquisition/twins/compare_sessions.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string>

#include "drivers/base/files.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMend = "compare the two files";

Result<std::set<std::string>> FilesOf(const fs::path& session) {
  std::set<std::string> files;
  std::error_code code;
  auto it = fs::recursive_directory_iterator(session, code);
  for (; !code && it != fs::recursive_directory_iterator(); it.increment(code)) {
    if (it.depth() == 0 && it->path().filename() == "derived") {
      it.disable_recursion_pending();
      continue;
    }
    if (it->is_regular_file()) files.insert(fs::relative(it->path(), session).generic_string());
  }
  if (code)
    return BadInput("cannot list the session (" + code.message() + ")", session.string(),
                    "name a session folder");
  return files;
}

}  // namespace

Status CompareSessions(const fs::path& a, const fs::path& b) {
  SCAN_TRY(const auto files_a, FilesOf(a));
  SCAN_TRY(const auto files_b, FilesOf(b));
  for (const std::string& file : files_a) {
    if (!files_b.contains(file))
      return Failed("the other session has no " + file, b.string(), kMend);
    SCAN_TRY(const std::string bytes_a, ReadTextFile(a / file));
    SCAN_TRY(const std::string bytes_b, ReadTextFile(b / file));
    if (bytes_a == bytes_b) continue;
    const auto split =
        std::mismatch(bytes_a.begin(), bytes_a.end(), bytes_b.begin(), bytes_b.end());
    const auto line = std::count(bytes_a.begin(), split.first, '\n') + 1;
    return Failed(fmt::format("{} differs from line {}, byte {} on", file, line,
                              split.first - bytes_a.begin()),
                  b.string(), kMend);
  }
  for (const std::string& file : files_b)
    if (!files_a.contains(file))
      return Failed("the other session has no " + file, a.string(), kMend);
  return {};
}

}  // namespace scan
