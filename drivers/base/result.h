// Result<T>: what the world can cause. A broken contract asserts instead.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace scan {

// Maps to the exit code of a command: failed and device 1, bad_input 2, cancelled 3.
enum class ErrorKind { failed, bad_input, cancelled, device };

// One line for a person: what happened, where (file, line, field, device), how to mend it.
struct Error {
  ErrorKind kind = ErrorKind::failed;
  std::string what;
  std::string where;
  std::string mend;
};

template <class T>
using Result = tl::expected<T, Error>;

using Status = Result<void>;

inline tl::unexpected<Error> Fail(ErrorKind kind, std::string what, std::string where,
                                  std::string mend) {
  return tl::unexpected<Error>(Error{kind, std::move(what), std::move(where), std::move(mend)});
}
inline tl::unexpected<Error> BadInput(std::string what, std::string where, std::string mend) {
  return Fail(ErrorKind::bad_input, std::move(what), std::move(where), std::move(mend));
}
inline tl::unexpected<Error> Failed(std::string what, std::string where, std::string mend) {
  return Fail(ErrorKind::failed, std::move(what), std::move(where), std::move(mend));
}
inline tl::unexpected<Error> DeviceFault(std::string what, std::string where, std::string mend) {
  return Fail(ErrorKind::device, std::move(what), std::move(where), std::move(mend));
}
inline tl::unexpected<Error> Cancelled(std::string where) {
  return Fail(ErrorKind::cancelled, "cancelled", std::move(where), "start it again when ready");
}

// "what: where; mend", without line breaks.
std::string ToString(const Error& error);

// The exit code of a command that ended with this error.
int ExitCode(const Error& error);

}  // namespace scan

#define SCAN_CONCAT_INNER(a, b) a##b
#define SCAN_CONCAT(a, b) SCAN_CONCAT_INNER(a, b)

// SCAN_TRY(auto mesh, ReadPly(path));  declares `mesh` or returns the error.
#define SCAN_TRY(declaration, expression) \
  SCAN_TRY_IMPL(SCAN_CONCAT(scan_try_, __LINE__), declaration, expression)
#define SCAN_TRY_IMPL(holder, declaration, expression)                          \
  auto holder = (expression);                                                   \
  if (!holder) return tl::unexpected<::scan::Error>(std::move(holder).error()); \
  declaration = std::move(*holder)

// SCAN_CHECK(WriteFile(...));  returns the error of a Status or Result whose value is not needed.
#define SCAN_CHECK(expression)                                             \
  do {                                                                     \
    if (auto scan_check = (expression); !scan_check)                       \
      return tl::unexpected<::scan::Error>(std::move(scan_check).error()); \
  } while (false)
