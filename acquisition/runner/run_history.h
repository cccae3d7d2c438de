// What a run that goes on with a session must know of the runs before.
#pragma once

#include <optional>
#include <vector>

#include "acquisition/runner/runner.h"
#include "acquisition/session/log_document.h"

namespace scan {

struct RunHistory {
  int reference_epoch = 0;        // of the last homing
  bool specimen_removed = false;  // for plates, and not put back
};
RunHistory HistoryOf(const std::vector<LogEntry>& log);

// The note that opens every run, so that a replay uses the same options.
NoteEntry NoteOf(const CaptureOptions& options);
// Nothing for another note.
std::optional<CaptureOptions> OptionsFrom(const NoteEntry& note);

NoteEntry NoteOf(SpecimenAction action, const PromptAnswer& answer);
// Nothing for another note, or for the answer to another question.
std::optional<PromptAnswer> AnswerFrom(const NoteEntry& note, SpecimenAction action);

}  // namespace scan
