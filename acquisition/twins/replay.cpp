#include "acquisition/twins/replay.h"

#include <fmt/format.h>

#include "acquisition/runner/run_history.h"
#include "acquisition/runner/run_words.h"
#include "acquisition/twins/replay_devices.h"

namespace scan {
namespace {

namespace words = run_words;

bool GoesOn(const LogEntry& entry) {
  const auto* resume = std::get_if<ResumeEntry>(&entry.payload);
  return resume && resume->reason == words::kAfterInterruption;
}

// The recorded answers of the operator.
SpecimenPrompt PromptOf(const std::shared_ptr<ReplayScript>& script) {
  return [script](SpecimenAction action, std::stop_token stop) -> Result<PromptAnswer> {
    if (stop.stop_requested()) return Cancelled("specimen prompt");
    const LogEntry* next = script->Next();
    const bool remove = action == SpecimenAction::remove;
    if (next) {
      const auto* fault = std::get_if<FaultEntry>(&next->payload);
      if (fault && fault->device == words::kPrompt &&
          fault->call == (remove ? words::kRemove : words::kPlace))
        return tl::unexpected<Error>(Error{fault->kind, fault->what, fault->where, fault->mend});
      if (const auto* note = std::get_if<NoteEntry>(&next->payload))
        if (const auto answer = AnswerFrom(*note, action)) return *answer;
    }
    return script->Missing(remove ? "removal of the specimen" : "return of the specimen");
  };
}

}  // namespace

Result<CaptureRequest> RequestOfRecording(const std::shared_ptr<ReplayScript>& script,
                                          const std::filesystem::path& copy) {
  CaptureRequest request;
  request.folder = copy;
  request.document = script->document();
  request.prompt = PromptOf(script);
  const LogEntry* first = script->Next();
  if (!first) return script->Missing("further run");
  request.resume = GoesOn(*first);
  bool found = false;
  for (std::size_t i = static_cast<std::size_t>(first->seq) + 1; i < script->log().size(); ++i) {
    const LogEntry& entry = script->log()[i];
    if (GoesOn(entry)) break;
    const auto* note = std::get_if<NoteEntry>(&entry.payload);
    if (!note) continue;
    if (const auto options = OptionsFrom(*note)) {
      request.options = *options;
      found = true;
    }
    if (note->values.contains(words::kPlatesKey)) request.prompt = nullptr;
  }
  if (!found)
    return BadInput("the session was not written by a capture, it cannot be replayed",
                    fmt::format("log.jsonl from document {}", first->seq),
                    "name a session that 'capture' or 'demo' made");
  return request;
}

Result<std::vector<CaptureReport>> ReplaySession(const std::filesystem::path& recording,
                                                 const std::filesystem::path& copy,
                                                 CaptureObserver* observer) {
  SCAN_TRY(const auto script, ReplayScript::Open(recording));
  Station station = MakeReplayStation(script);
  std::vector<CaptureReport> reports;
  while (const LogEntry* next = script->Next()) {
    if (!reports.empty() && !GoesOn(*next)) return script->Missing("end of the run");
    SCAN_TRY(const CaptureRequest request, RequestOfRecording(script, copy));
    CaptureControl control;
    script->Bind(&control);
    auto report = RunCapture(station, request, control, observer);
    script->Bind(nullptr);
    if (!report) return tl::unexpected<Error>(std::move(report).error());
    reports.push_back(std::move(*report));
  }
  return reports;
}

}  // namespace scan
