// One plain page on loopback: state, progress, the last picture, a stop button, the station's
// question.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>

#include "drivers/base/result.h"

namespace scan {

// What the page needs of the daemon. Thread contract: called from the page's threads.
struct PageBackend {
  std::function<nlohmann::json()> status;               // as the call `status`
  std::function<void()> stop;                           // as the call `stop`
  std::function<Status(bool confirmed)> answer;         // as the call `answer`
  std::function<std::filesystem::path()> last_picture;  // empty: none yet
};

// Serves until destroyed. Reachable from this machine only: bound to 127.0.0.1, and requests whose
// Host header names another host are refused, so that no web page elsewhere can reach it by a
// name that resolves to loopback. Stop needs no login.
class Page {
 public:
  // Port 0 takes a free one. Errors: bad_input when the port is taken.
  static Result<std::unique_ptr<Page>> Start(int port, PageBackend backend);
  ~Page();
  int port() const;

 private:
  struct Impl;
  explicit Page(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace scan
