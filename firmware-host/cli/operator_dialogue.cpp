#include "firmware-host/cli/operator_dialogue.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cstdio>

#include "firmware-host/cli/daemon_client.h"
#include "firmware-host/cli/terminal_progress.h"

namespace scan {
namespace {

bool AtTerminal() { return ::isatty(STDIN_FILENO) == 1; }

void Print(const std::string& question) {
  const bool remove = question == "remove";
  EndTerminalProgress();
  fmt::print(stderr, "{} {}\n",
             remove ? "Take the specimen off the platter for the background pictures."
                    : "Put the specimen back on the platter.",
             AtTerminal() ? (remove ? "Then press Enter (n: go on without them)."
                                    : "Then press Enter (n: end the capture).")
                          : "Then: scanstation confirm");
}

}  // namespace

void OperatorDialogue::Follow(RpcClient& daemon, const std::string& question) {
  if (question != shown_ && !question.empty()) Print(question);
  shown_ = question;
  if (question.empty() || !AtTerminal()) return;
  pollfd typed{STDIN_FILENO, POLLIN, 0};
  if (::poll(&typed, 1, 0) != 1 || !(typed.revents & POLLIN)) return;
  std::array<char, 64> line{};
  const ssize_t count = ::read(STDIN_FILENO, line.data(), line.size());
  if (count <= 0) return;
  const bool no = line[0] == 'n' || line[0] == 'N';
  (void)daemon.Call("answer", {{"confirmed", !no}, {"note", "terminal"}}, kDaemonPatience);
}

}  // namespace scan
