#include "firmware-host/cli/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

#include "drivers/base/unique_fd.h"

namespace scan {

Result<std::unique_ptr<ChildProcess>> ChildProcess::Start(const std::filesystem::path& program,
                                                          const std::vector<std::string>& arguments,
                                                          const std::filesystem::path& log) {
  if (::access(program.c_str(), X_OK) != 0)
    return Failed("cannot run (" + std::string(std::strerror(errno)) + ")", program.string(),
                  "build or install all programs together: ./run build");
  const UniqueFd log_fd(::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (!log_fd)
    return Failed("cannot write the log (" + std::string(std::strerror(errno)) + ")", log.string(),
                  "check the folder");
  std::vector<char*> argv;
  std::string name = program.string();
  std::vector<std::string> copies = arguments;
  argv.push_back(name.data());
  for (std::string& argument : copies) argv.push_back(argument.data());
  argv.push_back(nullptr);

  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  if (pid < 0)
    return Failed("cannot start a process (" + std::string(std::strerror(errno)) + ")", name,
                  "close other programs");
  if (pid == 0) {
    // Between fork and exec only async-signal-safe calls.
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(127);
    sigset_t none;
    sigemptyset(&none);
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
    ::setpgid(0, 0);  // Ctrl-C at the terminal is the parent's to handle
    ::dup2(log_fd.get(), STDERR_FILENO);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  return std::unique_ptr<ChildProcess>(new ChildProcess(pid));
}

bool ChildProcess::Ended() {
  if (pid_ > 0 && ::waitpid(pid_, nullptr, WNOHANG) == pid_) pid_ = -1;
  return pid_ < 0;
}

ChildProcess::~ChildProcess() {
  if (Ended()) return;
  ::kill(pid_, SIGTERM);
  for (int i = 0; i < 250 && !Ended(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  if (Ended()) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

std::filesystem::path ProgramFolder() {
  std::error_code code;
  return std::filesystem::read_symlink("/proc/self/exe", code).parent_path();
}

}  // namespace scan
