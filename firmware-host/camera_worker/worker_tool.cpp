#include "firmware-host/camera_worker/worker_tool.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "drivers/base/unique_fd.h"
#include "firmware-host/protocol/rpc.h"

namespace scan {
namespace {

using Json = nlohmann::json;
using SteadyClock = std::chrono::steady_clock;

constexpr std::size_t kMaxAnswer = 16U << 20;

struct Spawned {
  pid_t pid = -1;
  UniqueFd output;
};

Result<Spawned> Spawn(const std::filesystem::path& program,
                      const std::vector<std::string>& arguments) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0)
    return Failed("no pipe for a program's answer", program.string(), "close other programs");
  Spawned spawned{-1, UniqueFd(ends[0])};
  const UniqueFd write_end(ends[1]);
  std::vector<std::string> words{program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, write_end.get(), 1);
  const int error =
      posix_spawn(&spawned.pid, program.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error == 0) return spawned;
  return Failed(fmt::format("cannot run it: {}", std::strerror(error)), program.string(),
                "install the programs of scanstation in one folder");
}

}  // namespace

int PrintToolAnswer(const Result<Json>& answer) {
  const Json body = answer ? Json{{"ok", *answer}} : Json{{"error", ErrorToJson(answer.error())}};
  fmt::print("{}\n", body.dump(-1, ' ', false, Json::error_handler_t::replace));
  return answer ? 0 : ExitCode(answer.error());
}

Result<Json> RunWorkerTool(const std::filesystem::path& program,
                           const std::vector<std::string>& arguments,
                           std::chrono::milliseconds limit) {
  SCAN_TRY(const Spawned spawned, Spawn(program, arguments));
  const auto deadline = SteadyClock::now() + limit;
  std::string text;
  bool ended = false;
  while (!ended && text.size() < kMaxAnswer) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - SteadyClock::now());
    pollfd output{spawned.output.get(), POLLIN, 0};
    const int ready = left.count() > 0 ? poll(&output, 1, static_cast<int>(left.count())) : 0;
    if (ready == 0) break;
    if (ready < 0) continue;  // a signal: reading now could wait for ever
    std::array<char, 4096> buffer{};
    const ssize_t size = read(spawned.output.get(), buffer.data(), buffer.size());
    if (size > 0) text.append(buffer.data(), static_cast<std::size_t>(size));
    ended = size == 0;
  }
  if (!ended) kill(spawned.pid, SIGKILL);
  while (waitpid(spawned.pid, nullptr, 0) < 0 && errno == EINTR) {
  }
  const Json answer = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (ended && answer.is_object() && answer.contains("ok")) return answer["ok"];
  if (ended && answer.is_object() && answer.contains("error"))
    return tl::unexpected(ErrorFromJson(answer["error"]));
  return DeviceFault(ended ? "it died or answered nonsense" : "the camera does not answer",
                     program.filename().string(), "switch the camera off and on");
}

}  // namespace scan
