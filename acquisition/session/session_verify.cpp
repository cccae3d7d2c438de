#include "acquisition/session/session_verify.h"

#include <fmt/format.h>

#include <algorithm>

#include "acquisition/session/session_paths.h"
#include "acquisition/session/session_reader.h"
#include "drivers/base/files.h"
#include "drivers/base/sha256.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

const std::vector<FileDocument>* FilesOf(const LogEntry& entry) {
  if (const auto* frame = std::get_if<FrameEntry>(&entry.payload)) return &frame->files;
  if (const auto* reject = std::get_if<RejectEntry>(&entry.payload)) return &reject->files;
  const auto* note = std::get_if<NoteEntry>(&entry.payload);
  return note && note->plate ? &note->plate->files : nullptr;
}

Status CheckFile(const fs::path& session, const FileDocument& file, SessionReport& report) {
  const std::string where = (session / file.path).string();
  SCAN_TRY(const auto bytes, ReadBinaryFile(session / file.path));
  ++report.files_checked;
  report.bytes_checked += bytes.size();
  if (bytes.size() != file.bytes)
    return BadInput(fmt::format("{} bytes where the log says {}", bytes.size(), file.bytes), where,
                    "restore the file from the archive");
  if (Sha256Hex(bytes) != file.sha256)
    return BadInput("the bytes are not those that were logged", where,
                    "restore the file from the archive");
  return {};
}

void NoteStrangers(const fs::path& session, const SessionState& state, SessionReport& report) {
  std::vector<std::string> strangers;
  for (const char* folder : {"frames", "plates"}) {
    std::error_code code;
    for (fs::directory_iterator at(session / folder, code), end; !code && at != end;
         at.increment(code)) {
      const std::string path = std::string(folder) + "/" + at->path().filename().string();
      if (!state.IsNamed(path)) strangers.push_back(path);
    }
  }
  std::sort(strangers.begin(), strangers.end());
  for (const auto& path : strangers)
    report.notes.push_back(path + " is no part of the session: no document names it");
}

void CheckLog(const fs::path& session, const std::string& session_text, SessionState& state,
              const ProgressFn& progress, SessionReport& report) {
  std::string text;
  std::error_code code;
  if (fs::exists(session / kLogFile, code)) {
    auto read = ReadTextFile(session / kLogFile);
    if (!read) {
      report.problems.push_back(read.error());
      return;
    }
    text = std::move(*read);
  }
  const LogReading log = ReadLog(text, Sha256Hex(AsBytes(session_text)), state);
  report.log_documents = log.entries.size();
  report.problems.insert(report.problems.end(), log.damage.begin(), log.damage.end());
  if (log.entries.empty()) report.notes.push_back("the log has no document yet");
  if (log.torn_bytes > 0)
    report.notes.push_back(fmt::format("the last line of {} is torn: {} bytes do not count",
                                       kLogFile, log.torn_bytes));
  for (std::size_t i = 0; i < log.entries.size(); ++i) {
    Report(progress, "verify", static_cast<double>(i) / static_cast<double>(log.entries.size()));
    const auto* files = FilesOf(log.entries[i]);
    if (!files) continue;
    for (const auto& file : *files)
      if (const auto good = CheckFile(session, file, report); !good)
        report.problems.push_back(good.error());
  }
}

}  // namespace

Result<SessionReport> VerifySession(const fs::path& folder, const ProgressFn& progress) {
  const fs::path session = fs::absolute(folder).lexically_normal();
  std::error_code code;
  if (!fs::is_regular_file(session / kSessionFile, code))
    return BadInput("not a session (it has no session.json)", session.string(),
                    "name a session folder");
  SessionReport report;
  SCAN_TRY(const std::string text, ReadTextFile(session / kSessionFile));
  auto document = ParseSessionDocument(text, (session / kSessionFile).string());
  if (!document) {
    report.problems.push_back(document.error());
    return report;
  }
  SessionState state(std::move(*document));
  CheckLog(session, text, state, progress, report);
  for (const auto& view : state.views())
    (state.Complete(view) ? report.views_complete : report.views_missing).push_back(view.id);
  NoteStrangers(session, state, report);
  Report(progress, "verify", 1);
  return report;
}

}  // namespace scan
