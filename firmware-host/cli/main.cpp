// scanstation: the command line.
#include <fmt/format.h>
#include <signal.h>

#include <exception>
#include <new>
#include <thread>

#include "drivers/base/log.h"
#include "firmware-host/cli/command.h"
#include "firmware-host/cli/commands.h"
#include "firmware-host/cli/terminal_progress.h"

namespace {

// SIGINT and SIGTERM request the stop token; a second one ends the program at once.
class SignalWatch {
 public:
  SignalWatch() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    sigaddset(&signals_, SIGUSR2);  // ends the watch
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    thread_ = std::thread([this] {
      int signal = 0;
      while (sigwait(&signals_, &signal) == 0 && signal != SIGUSR2)
        if (!source_.request_stop()) std::_Exit(3);
    });
  }
  ~SignalWatch() {
    pthread_kill(thread_.native_handle(), SIGUSR2);
    thread_.join();
  }
  std::stop_token token() const { return source_.get_token(); }

 private:
  sigset_t signals_{};
  std::stop_source source_;
  std::thread thread_;
};

int Report(const scan::Error& error, bool json) {
  fmt::print(stderr, "scanstation: {}\n", ToString(error));
  if (json)
    fmt::print(
        "{}\n",
        scan::Json{{"error", {{"what", error.what}, {"where", error.where}, {"mend", error.mend}}}}
            .dump(2));
  return ExitCode(error);
}

// What a library or the machine throws (no memory, a file system that fails) ends the command like
// any error of its own.
scan::Result<scan::CommandOutput> Run(const scan::CommandFn& command,
                                      const scan::CliContext& context) {
  try {
    return command(context);
  } catch (const std::bad_alloc&) {
    return scan::Failed("out of memory", "this machine",
                        "end other programs, or give a smaller volume, fewer or smaller "
                        "photographs");
  } catch (const std::exception& e) {
    return scan::Failed(fmt::format("unexpected: {}", e.what()), "scanstation",
                        "check the disk and the input, and run again with --verbose");
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("scanstation: natural specimens as 3D models with true shape and true colour");
  app.require_subcommand(1);
  app.failure_message([](const CLI::App*, const CLI::Error& error) {
    return fmt::format("scanstation: {}; see --help\n", error.what());
  });
  app.set_version_flag("--version", SCAN_VERSION);
  scan::CommandSet commands(app);
  scan::AddAllCommands(commands);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }

  SignalWatch signals;
  scan::SetLogLevel(commands.verbose() ? scan::LogLevel::info : scan::LogLevel::warning);
  const scan::CliContext context{.json = commands.json(),
                                 .verbose = commands.verbose(),
                                 .progress = scan::MakeTerminalProgress(),
                                 .stop = signals.token()};
  const auto output = Run(commands.chosen(), context);
  scan::EndTerminalProgress();
  if (!output) return Report(output.error(), context.json);
  if (context.json)
    fmt::print("{}\n", output->json.dump(2));
  else
    fmt::print("{}", output->text);
  return output->exit_code;
}
