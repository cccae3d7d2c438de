#include "acquisition/session/session_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "acquisition/session/json_fields.h"
#include "acquisition/session/session_paths.h"
#include "drivers/base/files.h"
#include "drivers/base/sha256.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

Status CheckPictures(std::span<const EncodedFile> pictures, const std::string& where) {
  if (pictures.empty()) return BadInput("no picture", where, "give at least one");
  std::set<std::string> extensions;
  for (const auto& picture : pictures) {
    if (!IsPictureExtension(picture.extension))
      return BadInput("pictures of kind '" + picture.extension + "' have no place in a session",
                      where, "use jpg, png, tif, dng, nef, cr2 or arw");
    if (!extensions.insert(picture.extension).second)
      return BadInput("two pictures of one kind", where, "give each its own extension");
    if (picture.bytes.empty())
      return BadInput("an empty picture", where, "check the camera and take it again");
  }
  return {};
}

}  // namespace

Result<SessionWriter> SessionWriter::Create(std::unique_ptr<SessionSink> sink,
                                            const SessionDocument& document, Timestamp now) {
  SCAN_TRY(const std::string text, SerialiseSessionDocument(document));
  SCAN_CHECK(sink->CreateFolder(""));
  for (const char* folder : {"frames", "plates", "derived"}) SCAN_CHECK(sink->CreateFolder(folder));
  SCAN_CHECK(sink->WriteFile(kSessionFile, AsBytes(text)));
  SessionWriter writer(std::move(sink), SessionState(document), std::string(kNoPreviousLine));
  SCAN_CHECK(writer.Start(Sha256Hex(AsBytes(text)), now));
  return writer;
}

Result<SessionWriter> SessionWriter::Resume(std::unique_ptr<SessionSink> sink,
                                            const Session& session, Timestamp now) {
  for (const char* folder : {"frames", "plates", "derived"}) SCAN_CHECK(sink->CreateFolder(folder));
  if (session.torn_bytes > 0) SCAN_CHECK(sink->CutLog(session.log_bytes));
  SessionWriter writer(std::move(sink), session.state, session.last_sha256);
  if (!writer.state_.started()) SCAN_CHECK(writer.Start(session.session_sha256, now));
  return writer;
}

Status SessionWriter::Start(const std::string& session_sha256, Timestamp now) {
  SCAN_CHECK(Write(StartEntry{session_sha256}, now));
  return {};
}

Result<std::int64_t> SessionWriter::Write(LogPayload payload, Timestamp now) {
  const std::string where = fmt::format("{} line {}", kLogFile, state_.next_seq() + 1);
  if (broken_)
    return Failed("the session cannot be written since an earlier write failed", where,
                  "resume the session");
  const LogEntry entry{state_.next_seq(), now, last_sha256_, std::move(payload)};
  SCAN_TRY(const std::string line, SerialiseLogEntry(entry));
  // What could not be read back must not be written.
  SCAN_CHECK(ParseLogEntry(line, where));
  SCAN_CHECK(state_.Check(entry, where));
  if (auto appended = sink_->AppendToLog(line); !appended) {
    broken_ = true;
    return tl::unexpected<Error>(appended.error());
  }
  SCAN_CHECK(state_.Apply(entry, where));
  last_sha256_ = Sha256Hex(AsBytes(line));
  return entry.seq;
}

Result<std::int64_t> SessionWriter::Append(LogPayload payload, Timestamp now) {
  const auto* note = std::get_if<NoteEntry>(&payload);
  if (std::holds_alternative<FrameEntry>(payload) || (note && note->plate))
    return BadInput("a frame or plate without its pictures", kLogFile,
                    "use AppendFrame or AppendPlate");
  return Write(std::move(payload), now);
}

template <class PathOf>
Result<std::vector<FileDocument>> SessionWriter::WritePictures(
    std::span<const EncodedFile> pictures, const PathOf& path_of) {
  int retake = 0;
  const auto taken = [&](const EncodedFile& picture) {
    return state_.IsNamed(path_of(retake, picture.extension));
  };
  while (std::any_of(pictures.begin(), pictures.end(), taken)) ++retake;
  std::vector<FileDocument> files;
  for (const auto& picture : pictures) {
    files.push_back(
        {path_of(retake, picture.extension), picture.bytes.size(), Sha256Hex(picture.bytes)});
    SCAN_CHECK(sink_->WriteFile(files.back().path, picture.bytes));
  }
  return files;
}

Result<std::int64_t> SessionWriter::AppendFrame(FrameEntry frame,
                                                std::span<const EncodedFile> pictures,
                                                Timestamp now) {
  const std::string where = "frame of view '" + frame.view + "'";
  SCAN_CHECK(CheckPictures(pictures, where));
  const PlannedView* view = state_.FindView(frame.view);
  if (!view) return BadInput("unknown view", where, "name a view of the plan");
  if (state_.Frame(frame.view, frame.slice))
    return BadInput("the view has its frame already", where, "log a retake before the new frame");
  SCAN_TRY(frame.files, WritePictures(pictures, [&](int retake, const std::string& extension) {
             return FramePath(*view, frame.slice, retake, extension);
           }));
  return Write(std::move(frame), now);
}

Result<std::int64_t> SessionWriter::AppendPlate(PlateDocument plate,
                                                std::span<const EncodedFile> pictures,
                                                Timestamp now) {
  SCAN_CHECK(CheckPictures(pictures, "plate of camera '" + plate.camera + "'"));
  if (!IsId(plate.camera) || (plate.plate == PlateKind::background && !IsId(plate.aim_id)))
    return BadInput("a plate without camera or aim", "plate of camera '" + plate.camera + "'",
                    "name the camera, and the aim of a background");
  SCAN_TRY(plate.files, WritePictures(pictures, [&](int retake, const std::string& extension) {
             return PlatePath(plate.plate, plate.aim_id, plate.camera, retake, extension);
           }));
  return Write(NoteEntry{"plate", std::move(plate)}, now);
}

Result<std::int64_t> SessionWriter::AppendReject(RejectEntry reject,
                                                 std::span<const EncodedFile> pictures,
                                                 Timestamp now) {
  const std::string& what = reject.view.empty() ? reject.aim_id : reject.view;
  if (CheckPictures(pictures, "rejected picture of '" + what + "'")) {
    SCAN_TRY(reject.files, WritePictures(pictures, [&](int number, const std::string& extension) {
               return RejectPath(what, reject.camera, number, extension);
             }));
  }
  return Write(std::move(reject), now);
}

Result<SessionWriter> CreateSession(const fs::path& folder, const SessionDocument& document,
                                    Timestamp now) {
  return SessionWriter::Create(std::make_unique<FolderSink>(folder), document, now);
}

Result<SessionWriter> ResumeSession(const fs::path& folder, Timestamp now) {
  auto sink = std::make_unique<FolderSink>(folder);
  std::error_code code;
  if (!fs::is_regular_file(folder / kSessionFile, code))
    return BadInput("not a session (it has no session.json)", folder.string(),
                    "name a session folder");
  SCAN_CHECK(sink->LockLog());  // before reading, so that no other writer can come between
  SCAN_TRY(const Session session, ReadSession(folder));
  return SessionWriter::Resume(std::move(sink), session, now);
}

}  // namespace scan
