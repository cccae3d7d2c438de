// A recorded session as the score that replay devices play from.
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "acquisition/runner/capture_control.h"
#include "acquisition/session/session_reader.h"
#include "drivers/base/clock.h"
#include "drivers/base/result.h"
#include "drivers/camera/camera.h"

namespace scan {

// The place in the recording is the document that the run has to write next: reading the clock
// stamps it and goes on. Devices answer from the document at that place, or with a fault.
// Thread contract: every call may come from any thread.
class ReplayScript {
 public:
  // Errors: bad_input for a folder that is no whole session.
  static Result<std::shared_ptr<ReplayScript>> Open(const std::filesystem::path& session);

  const SessionDocument& document() const { return session_.document; }
  const std::vector<LogEntry>& log() const { return session_.log; }

  // The document to be written next; null at the end of the recording.
  const LogEntry* Next() const;
  // The one written last; null at the start.
  const LogEntry* Last() const;
  // The time of Next, and goes on; at the end of the recording that of the last document. Where the
  // recording was paused, resumed or stopped after it, the bound control is told so.
  Timestamp Stamp();

  // Pause, resume and stop of the recording reach this control; null: none. It must stay alive.
  void Bind(CaptureControl* control);

  // Pictures of the recording. Errors: device for a missing or altered file.
  Result<std::vector<EncodedFile>> ReadPictures(const std::vector<FileDocument>& files) const;

  // "the recording has no WHAT after document N".
  tl::unexpected<Error> Missing(const std::string& what) const;

 private:
  explicit ReplayScript(Session session) : session_(std::move(session)) {}
  void TellControl();

  const Session session_;
  mutable std::mutex mutex_;
  std::size_t next_ = 0;
  CaptureControl* control_ = nullptr;
};

}  // namespace scan
