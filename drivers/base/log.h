// key=value lines on standard error, for the systemd journal and for people.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

namespace scan {

enum class LogLevel { debug, info, warning, error };

struct LogField {
  std::string_view key;
  std::string value;
};

// Lines below this level are dropped; the default is info. Call once, before threads start.
void SetLogLevel(LogLevel level);

// Writes one line: level=info event=move_done axis=turntable ... Values with blanks or quotes are
// quoted. Thread-safe.
void Log(LogLevel level, std::string_view event, std::initializer_list<LogField> fields = {});

}  // namespace scan
