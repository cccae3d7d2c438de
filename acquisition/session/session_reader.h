// Reads a session folder: session.json, log.jsonl and what they add up to.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/session/log_document.h"
#include "acquisition/session/session_document.h"
#include "acquisition/session/session_state.h"
#include "drivers/base/result.h"

namespace scan {

struct LogReading {
  std::vector<LogEntry> entries;  // whole lines up to the first damage
  std::uint64_t valid_bytes = 0;  // of those lines, newlines included
  std::uint64_t torn_bytes = 0;   // after the last newline: an unfinished line, cut off
  std::string last_sha256 = std::string(kNoPreviousLine);  // of the last whole line
  std::vector<Error> damage;  // at most one: the first line that cannot be right
};

// Reads the text of a log, checking chain, sequence and the hash of session.json in its start
// document, and takes every entry up into `state`.
LogReading ReadLog(std::string_view text, const std::string& session_sha256, SessionState& state);

struct Session {
  std::filesystem::path folder;  // absolute
  SessionDocument document;
  std::vector<LogEntry> log;
  std::uint64_t log_bytes = 0;   // of whole lines
  std::uint64_t torn_bytes = 0;  // cut off after them
  std::string last_sha256;       // of the last whole line
  std::string session_sha256;    // of session.json
  SessionState state;            // document and log taken together
};

// Pictures are not opened. A torn last line is left out; any other damage is an error that names
// the line. Errors: bad_input.
// Thread contract: pure.
Result<Session> ReadSession(const std::filesystem::path& folder);

}  // namespace scan
