#include "tests/system/run_program.h"

#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "tests/support/temp_folder.h"

namespace scan {
namespace {

std::string Quoted(const std::string& word) {
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string Slurp(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace

ProgramRun RunProgram(const std::string& program, const std::vector<std::string>& arguments) {
  const TempFolder folder;
  std::string command = Quoted(std::string(SCAN_BIN_DIR) + "/" + program);
  for (const std::string& argument : arguments) command += " " + Quoted(argument);
  command += " >" + Quoted((folder.path() / "out").string()) + " 2>" +
             Quoted((folder.path() / "err").string()) + " </dev/null";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
          Slurp(folder.path() / "out"), Slurp(folder.path() / "err")};
}

}  // namespace scan
