#include "firmware-host/camera_worker/worker_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstring>
#include <future>
#include <mutex>
#include <optional>
#include <thread>

#include "firmware-host/camera_worker/worker_link.h"

namespace scan {
namespace {

constexpr std::chrono::milliseconds kExitPatience{3000};  // for a camera to be closed in peace
constexpr std::chrono::milliseconds kKillPatience{2000};  // longer: it hangs inside the kernel

#if defined(__x86_64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_AARCH64;
#elif defined(__arm__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_ARM;
#else
constexpr std::uint32_t kArchitecture = 0;  // no filter
#endif

// Refuses socket() of every family that reaches beyond this machine; Unix and netlink sockets
// (udev's hot-plug messages) stay. A network namespace of its own would take those messages away.
// Async-signal-safe.
void DenyNetwork() {
  if (kArchitecture == 0) return;
  const auto offset_of_family = offsetof(seccomp_data, args);  // args[0], low half: little-endian
  std::array<sock_filter, 11> program = {{
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, arch)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kArchitecture, 1, 0),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, __NR_socket, 1, 0),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(offset_of_family)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, AF_UNIX, 2, 0),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, AF_NETLINK, 1, 0),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
  }};
  sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter, 0, 0);
}

// Between fork and exec: only async-signal-safe calls.
[[noreturn]] void BecomeWorker(int socket, int null, pid_t owner, char* const* argv) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != owner) ::_exit(127);
  ::setpgid(0, 0);  // Ctrl-C at the terminal is the owner's to handle
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::dup2(null, STDIN_FILENO);
  ::dup2(STDERR_FILENO, STDOUT_FILENO);
  if (socket == kWorkerSocketFd)
    ::fcntl(socket, F_SETFD, 0);
  else
    ::dup2(socket, kWorkerSocketFd);
  ::close_range(kWorkerSocketFd + 1, ~0U, 0);
  DenyNetwork();
  ::execv(argv[0], argv);
  ::_exit(127);
}

std::string DescribeEnd(int status) {
  if (WIFSIGNALED(status)) return fmt::format("was killed by signal {}", WTERMSIG(status));
  return fmt::format("exited with code {}", WEXITSTATUS(status));
}

// What the keeper of a process and its owner share.
struct Life {
  std::mutex mutex;
  std::condition_variable ended;
  pid_t pid = -1;
  std::optional<int> status;  // set when it has been reaped

  bool WaitEnded(std::chrono::milliseconds patience) {
    std::unique_lock lock(mutex);
    return ended.wait_for(lock, patience, [this] { return status.has_value(); });
  }
  void SignalGroup(int signal) {
    const std::lock_guard lock(mutex);
    if (!status) ::kill(-pid, signal);  // not reaped: the number is still its own
  }
};

// Forks and reaps on a thread that lives as long as the process: the kernel sends the parent-death
// signal when the *thread* that forked ends. A process that hangs inside the kernel and cannot be
// killed keeps its thread waiting, which harms nobody; so the thread is not joined.
Result<std::shared_ptr<Life>> StartKept(UniqueFd socket, const std::vector<std::string>& words) {
  auto life = std::make_shared<Life>();
  std::promise<int> started;  // errno, 0 when it runs
  auto outcome = started.get_future();
  std::thread([life, words, socket = std::move(socket), started = std::move(started)]() mutable {
    std::vector<std::string> copies = words;
    std::vector<char*> argv;
    for (std::string& word : copies) argv.push_back(word.data());
    argv.push_back(nullptr);
    UniqueFd null(::open("/dev/null", O_RDONLY | O_CLOEXEC));
    const pid_t owner = ::getpid();
    const pid_t pid = ::fork();
    if (pid == 0) BecomeWorker(socket.get(), null.get(), owner, argv.data());
    if (pid > 0) ::setpgid(pid, pid);  // whichever of the two comes first
    socket.Reset();
    null.Reset();
    life->pid = pid;
    started.set_value(pid < 0 ? errno : 0);
    if (pid < 0) return;
    siginfo_t info{};
    while (::waitid(P_PID, static_cast<id_t>(pid), &info, WEXITED | WNOWAIT) != 0 && errno == EINTR)
      ;
    const std::lock_guard lock(life->mutex);
    int status = 0;
    ::waitpid(pid, &status, 0);
    life->status = status;
    life->ended.notify_all();
  }).detach();
  if (const int error = outcome.get(); error != 0)
    return Failed(std::string("cannot start a process (") + std::strerror(error) + ")", words[0],
                  "close other programs");
  return life;
}

class WorkerProcess final : public CameraWorker {
 public:
  WorkerProcess(std::shared_ptr<Life> life, UniqueFd socket)
      : life_(std::move(life)), socket_(std::move(socket)) {}

  // Its socket is closed by now: it closes the camera and exits by itself, unless it hangs.
  ~WorkerProcess() override {
    socket_.Reset();
    if (!life_->WaitEnded(kExitPatience)) (void)Kill();
  }

  UniqueFd TakeSocket() override { return std::move(socket_); }

  std::string Kill() override {
    // A moment for one that is just dying by itself to say how.
    if (!life_->WaitEnded(std::chrono::milliseconds(50))) life_->SignalGroup(SIGKILL);
    if (!life_->WaitEnded(kKillPatience))
      return "hangs inside the kernel and cannot be killed: unplug the camera, or restart";
    const std::lock_guard lock(life_->mutex);
    return DescribeEnd(*life_->status);
  }

 private:
  std::shared_ptr<Life> life_;
  UniqueFd socket_;
};

}  // namespace

CameraWorkerLauncher WorkerProgram(std::filesystem::path program,
                                   std::vector<std::string> arguments) {
  std::vector<std::string> words = {program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return [words]() -> Result<std::unique_ptr<CameraWorker>> {
    if (::access(words[0].c_str(), X_OK) != 0)
      return Failed("cannot run the camera worker (" + std::string(std::strerror(errno)) + ")",
                    words[0],
                    "build or install all programs together; this one needs its camera library");
    SCAN_TRY(auto sockets, WorkerSocketPair());
    SCAN_TRY(std::shared_ptr<Life> life, StartKept(std::move(sockets.second), words));
    return std::make_unique<WorkerProcess>(std::move(life), std::move(sockets.first));
  };
}

std::filesystem::path WorkerProgramPath(std::string_view name) {
  std::error_code code;
  return std::filesystem::read_symlink("/proc/self/exe", code).parent_path() / name;
}

}  // namespace scan
