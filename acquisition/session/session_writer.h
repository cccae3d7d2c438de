// Writes a session folder so that it is whole after a power cut at any instant.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>

#include "acquisition/session/log_document.h"
#include "acquisition/session/session_document.h"
#include "acquisition/session/session_reader.h"
#include "acquisition/session/session_sink.h"
#include "acquisition/session/session_state.h"
#include "drivers/base/clock.h"
#include "drivers/base/result.h"
#include "drivers/camera/camera.h"

namespace scan {

// Every document carries the time that the caller gives; the writer reads no clock. After a failed
// append no more is written (a part of the line may be on disk): the session is to be resumed.
// Thread contract: one thread at a time.
class SessionWriter {
 public:
  // Writes session.json, the folders and the start document.
  // Errors: bad_input for an invalid document or a folder that is not empty; failed from the disk.
  static Result<SessionWriter> Create(std::unique_ptr<SessionSink> sink,
                                      const SessionDocument& document, Timestamp now);
  // Goes on after the last whole line of a session that was read, cutting a torn one off.
  static Result<SessionWriter> Resume(std::unique_ptr<SessionSink> sink, const Session& session,
                                      Timestamp now);

  // Appends any document but start, and but frames and plates (they have pictures).
  // Returns its sequence number. Errors: bad_input for one that contradicts the session.
  Result<std::int64_t> Append(LogPayload payload, Timestamp now);

  // Makes the pictures durable, then appends the frame document; `frame.files` is filled in here.
  // Errors: bad_input for an unknown view, a view that has its frame (log a retake first), an
  // extension that is none of jpg png tif dng nef cr2 arw.
  Result<std::int64_t> AppendFrame(FrameEntry frame, std::span<const EncodedFile> pictures,
                                   Timestamp now);

  // The same for a plate, which is logged as a note; `plate.files` is filled in here.
  Result<std::int64_t> AppendPlate(PlateDocument plate, std::span<const EncodedFile> pictures,
                                   Timestamp now);

  // The same for a picture that did not count; `reject.files` is filled in here. A frame without
  // any whole file is logged without pictures.
  Result<std::int64_t> AppendReject(RejectEntry reject, std::span<const EncodedFile> pictures,
                                    Timestamp now);

  const SessionState& state() const { return state_; }

 private:
  SessionWriter(std::unique_ptr<SessionSink> sink, SessionState state, std::string last_sha256)
      : sink_(std::move(sink)), state_(std::move(state)), last_sha256_(std::move(last_sha256)) {}
  Status Start(const std::string& session_sha256, Timestamp now);
  Result<std::int64_t> Write(LogPayload payload, Timestamp now);
  // `path_of` a retake number and an extension.
  template <class PathOf>
  Result<std::vector<FileDocument>> WritePictures(std::span<const EncodedFile> pictures,
                                                  const PathOf& path_of);

  std::unique_ptr<SessionSink> sink_;
  SessionState state_;
  std::string last_sha256_;
  bool broken_ = false;
};

// On disk. Errors: as Create.
Result<SessionWriter> CreateSession(const std::filesystem::path& folder,
                                    const SessionDocument& document, Timestamp now);

// Locks the session, reads it and goes on. Errors: bad_input for a damaged session; failed when
// another program is writing it.
Result<SessionWriter> ResumeSession(const std::filesystem::path& folder, Timestamp now);

}  // namespace scan
