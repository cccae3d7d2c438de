#include "acquisition/runner/run_history.h"

#include <fmt/format.h>

#include <charconv>

#include "acquisition/runner/run_words.h"

namespace scan {
namespace {

namespace words = run_words;

template <class Number>
std::optional<Number> NumberFrom(const NoteEntry& note, const char* key) {
  const auto found = note.values.find(key);
  if (found == note.values.end()) return std::nullopt;
  Number number{};
  const char* end = found->second.data() + found->second.size();
  const auto read = std::from_chars(found->second.data(), end, number);
  if (read.ec != std::errc() || read.ptr != end) return std::nullopt;
  return number;
}

bool Has(const NoteEntry& note, const char* key, std::string_view value) {
  const auto found = note.values.find(key);
  return found != note.values.end() && found->second == value;
}

}  // namespace

RunHistory HistoryOf(const std::vector<LogEntry>& log) {
  RunHistory history;
  for (const LogEntry& entry : log) {
    if (const auto* home = std::get_if<HomeEntry>(&entry.payload))
      history.reference_epoch = home->reference_epoch;
    const auto* note = std::get_if<NoteEntry>(&entry.payload);
    if (!note) continue;
    if (const auto answer = AnswerFrom(*note, SpecimenAction::remove); answer && answer->confirmed)
      history.specimen_removed = true;
    if (const auto answer = AnswerFrom(*note, SpecimenAction::place); answer && answer->confirmed)
      history.specimen_removed = false;
  }
  return history;
}

NoteEntry NoteOf(const CaptureOptions& options) {
  NoteEntry note;
  note.text = "options of this run";
  note.values = {
      {words::kAttemptsKey, fmt::format("{}", options.max_attempts)},
      {words::kOnFailedViewKey, options.on_failed_view == OnFailedView::go_on ? "go_on" : "end"},
      {words::kToleranceKey, fmt::format("{}", options.settings_tolerance_rel)}};
  return note;
}

std::optional<CaptureOptions> OptionsFrom(const NoteEntry& note) {
  const auto attempts = NumberFrom<int>(note, words::kAttemptsKey);
  const auto tolerance = NumberFrom<double>(note, words::kToleranceKey);
  if (!attempts || !tolerance) return std::nullopt;
  CaptureOptions options;
  options.max_attempts = *attempts;
  options.settings_tolerance_rel = *tolerance;
  options.on_failed_view =
      Has(note, words::kOnFailedViewKey, "end") ? OnFailedView::end : OnFailedView::go_on;
  return options;
}

NoteEntry NoteOf(SpecimenAction action, const PromptAnswer& answer) {
  NoteEntry note;
  const bool remove = action == SpecimenAction::remove;
  note.text = fmt::format("specimen {}{}", answer.confirmed ? "" : "not ",
                          remove ? "removed for background plates" : "put back");
  if (!answer.note.empty()) note.text += ": " + answer.note;
  note.values = {{words::kPromptKey, std::string(NameOf(action))},
                 {words::kConfirmedKey, answer.confirmed ? "yes" : "no"},
                 {words::kNoteKey, answer.note}};
  return note;
}

std::optional<PromptAnswer> AnswerFrom(const NoteEntry& note, SpecimenAction action) {
  if (!Has(note, words::kPromptKey, NameOf(action))) return std::nullopt;
  PromptAnswer answer;
  answer.confirmed = Has(note, words::kConfirmedKey, "yes");
  if (const auto text = note.values.find(words::kNoteKey); text != note.values.end())
    answer.note = text->second;
  return answer;
}

}  // namespace scan
