// A child program that ends with its owner.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "drivers/base/result.h"

namespace scan {

class ChildProcess {
 public:
  // Standard error goes to `log`. The child also dies when this program dies.
  // Errors: failed, when the program or the log cannot be opened.
  static Result<std::unique_ptr<ChildProcess>> Start(const std::filesystem::path& program,
                                                     const std::vector<std::string>& arguments,
                                                     const std::filesystem::path& log);
  ~ChildProcess();  // SIGTERM, then SIGKILL after 5 s

  // Reaps it when it has ended; nothing while it runs.
  bool Ended();

 private:
  explicit ChildProcess(pid_t pid) : pid_(pid) {}
  pid_t pid_;
};

// The folder of the running program.
std::filesystem::path ProgramFolder();

}  // namespace scan
