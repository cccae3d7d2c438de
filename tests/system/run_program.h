// Runs one of the project's programs as its users do.
#pragma once

#include <string>
#include <vector>

namespace scan {

struct ProgramRun {
  int exit_code = -1;
  std::string out, err;
};

// `program` is a name in the build's bin folder.
ProgramRun RunProgram(const std::string& program, const std::vector<std::string>& arguments);

}  // namespace scan
