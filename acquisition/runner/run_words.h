// Words of a run's log that programs read again: on resume and in a replay.
#pragma once

namespace scan::run_words {

// Devices of fault documents, beside the camera ids.
inline constexpr const char* kMotion = "motion";
inline constexpr const char* kLight = "light";
inline constexpr const char* kPrompt = "prompt";
inline constexpr const char* kView = "view";  // no device: a view that failed for good

// Calls of fault documents.
inline constexpr const char* kHome = "home";
inline constexpr const char* kMove = "move";
inline constexpr const char* kConfigure = "configure";
inline constexpr const char* kGrab = "grab";
inline constexpr const char* kOn = "on";
inline constexpr const char* kOff = "off";
inline constexpr const char* kRemove = "remove";
inline constexpr const char* kPlace = "place";

// Keys of note values.
inline constexpr const char* kPromptKey = "prompt";  // remove or place
inline constexpr const char* kConfirmedKey = "confirmed";
inline constexpr const char* kNoteKey = "note";
inline constexpr const char* kPlatesKey = "plates";  // "none": the run has no prompt
inline constexpr const char* kAttemptsKey = "max_attempts";
inline constexpr const char* kOnFailedViewKey = "on_failed_view";
inline constexpr const char* kToleranceKey = "settings_tolerance_rel";

// Reasons of resume documents.
inline constexpr const char* kAfterPause = "the pause was ended";
inline constexpr const char* kAfterInterruption = "the interrupted session goes on";

}  // namespace scan::run_words
