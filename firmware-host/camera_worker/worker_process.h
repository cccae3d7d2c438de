// Starts a camera worker program and ends it, whatever state it is in.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/base/result.h"
#include "drivers/base/unique_fd.h"

namespace scan {

constexpr int kWorkerSocketFd = 3;  // where a worker program finds its socket

// One life of a worker.
class CameraWorker {
 public:
  virtual ~CameraWorker() = default;  // ends it
  // The owner's end of its socket. Precondition: called once.
  virtual UniqueFd TakeSocket() = 0;
  // Ends it at once and says how it ended ("was killed by signal 9", "exited with code 1").
  virtual std::string Kill() = 0;
};

using CameraWorkerLauncher = std::function<Result<std::unique_ptr<CameraWorker>>()>;

// A launcher of `program`: no shell, a process group of its own, no descriptor but the socket and
// standard error, SIGKILL when the owner's process dies, no network (a seccomp filter leaves Unix
// and netlink sockets; a kernel without seccomp runs the worker all the same). The launcher's
// errors: failed, when the program cannot be run.
// Thread contract: a worker's calls from one thread at a time.
CameraWorkerLauncher WorkerProgram(std::filesystem::path program,
                                   std::vector<std::string> arguments = {});

// Where the worker programs are: beside the running program.
std::filesystem::path WorkerProgramPath(std::string_view name);

}  // namespace scan
