#include "acquisition/session/session_reader.h"

#include <fmt/format.h>

#include "acquisition/session/session_paths.h"
#include "drivers/base/files.h"
#include "drivers/base/sha256.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

Status CheckLink(const LogEntry& entry, const std::string& previous_sha256,
                 const std::string& session_sha256, const std::string& where) {
  if (entry.prev_sha256 != previous_sha256)
    return BadInput("the chain is broken: prev_sha256 is not that of the line before",
                    where + ": prev_sha256", "a line was altered; restore it from the archive");
  const auto* start = std::get_if<StartEntry>(&entry.payload);
  if (start && start->session_sha256 != session_sha256)
    return BadInput("session.json is not the one this log began with", where + ": session_sha256",
                    "restore session.json from the archive");
  return {};
}

}  // namespace

LogReading ReadLog(std::string_view text, const std::string& session_sha256, SessionState& state) {
  LogReading reading;
  const std::size_t whole = text.rfind('\n') == text.npos ? 0 : text.rfind('\n') + 1;
  reading.torn_bytes = text.size() - whole;
  for (std::size_t begin = 0; begin < whole;) {
    const std::string_view line = text.substr(begin, text.find('\n', begin) - begin);
    const std::string where = fmt::format("{} line {}", kLogFile, reading.entries.size() + 1);
    auto entry = ParseLogEntry(line, where);
    Status good = entry ? CheckLink(*entry, reading.last_sha256, session_sha256, where)
                        : Status(tl::unexpected<Error>(entry.error()));
    if (good) good = state.Apply(*entry, where);
    if (!good) {
      reading.damage.push_back(good.error());
      return reading;
    }
    reading.last_sha256 = Sha256Hex(AsBytes(line));
    reading.entries.push_back(std::move(*entry));
    begin += line.size() + 1;
    reading.valid_bytes = begin;
  }
  return reading;
}

Result<Session> ReadSession(const fs::path& folder) {
  const fs::path absolute = fs::absolute(folder).lexically_normal();
  std::error_code code;
  if (!fs::is_regular_file(absolute / kSessionFile, code))
    return BadInput("not a session (it has no session.json)", absolute.string(),
                    "name a session folder");
  SCAN_TRY(const std::string text, ReadTextFile(absolute / kSessionFile));
  SCAN_TRY(SessionDocument document,
           ParseSessionDocument(text, (absolute / kSessionFile).string()));
  std::string log_text;
  if (fs::exists(absolute / kLogFile, code)) {
    SCAN_TRY(log_text, ReadTextFile(absolute / kLogFile));
  }
  SessionState state(document);
  const std::string session_sha256 = Sha256Hex(AsBytes(text));
  LogReading reading = ReadLog(log_text, session_sha256, state);
  if (!reading.damage.empty()) {
    Error error = reading.damage.front();
    error.where = absolute.string() + ": " + error.where;
    return tl::unexpected<Error>(std::move(error));
  }
  return Session{absolute,
                 std::move(document),
                 std::move(reading.entries),
                 reading.valid_bytes,
                 reading.torn_bytes,
                 std::move(reading.last_sha256),
                 session_sha256,
                 std::move(state)};
}

}  // namespace scan
