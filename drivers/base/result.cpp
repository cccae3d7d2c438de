#include "drivers/base/result.h"

#include <algorithm>

namespace scan {

std::string ToString(const Error& error) {
  std::string line = error.what;
  if (!error.where.empty()) line += ": " + error.where;
  if (!error.mend.empty()) line += "; " + error.mend;
  std::replace_if(
      line.begin(), line.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return line;
}

int ExitCode(const Error& error) {
  switch (error.kind) {
    case ErrorKind::bad_input:
      return 2;
    case ErrorKind::cancelled:
      return 3;
    case ErrorKind::failed:
    case ErrorKind::device:
      return 1;
  }
  return 1;
}

}  // namespace scan
