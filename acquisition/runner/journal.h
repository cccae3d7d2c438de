// The session's log as a run writes it: one reading of the clock for each document.
#pragma once

#include <memory>
#include <span>
#include <utility>

#include "acquisition/session/session_writer.h"
#include "drivers/base/clock.h"

namespace scan {

// Thread contract: one thread at a time. Errors: as SessionWriter.
class Journal {
 public:
  Journal(SessionWriter writer, std::shared_ptr<Clock> clock)
      : writer_(std::move(writer)), clock_(std::move(clock)) {}

  Status Append(LogPayload payload) {
    SCAN_CHECK(writer_.Append(std::move(payload), clock_->Now()));
    return {};
  }
  Status AppendFrame(FrameEntry frame, std::span<const EncodedFile> pictures) {
    SCAN_CHECK(writer_.AppendFrame(std::move(frame), pictures, clock_->Now()));
    return {};
  }
  Status AppendPlate(PlateDocument plate, std::span<const EncodedFile> pictures) {
    SCAN_CHECK(writer_.AppendPlate(std::move(plate), pictures, clock_->Now()));
    return {};
  }
  Status AppendReject(RejectEntry reject, std::span<const EncodedFile> pictures) {
    SCAN_CHECK(writer_.AppendReject(std::move(reject), pictures, clock_->Now()));
    return {};
  }
  const SessionState& state() const { return writer_.state(); }

 private:
  SessionWriter writer_;
  std::shared_ptr<Clock> clock_;
};

}  // namespace scan
