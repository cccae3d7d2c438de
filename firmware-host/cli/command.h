// What every subcommand shares: global options, progress, the way results are printed.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>

#include "drivers/base/progress.h"
#include "drivers/base/result.h"

namespace scan {

using Json = nlohmann::json;

struct CliContext {
  bool json = false;  // results as JSON on standard output
  bool verbose = false;
  ProgressFn progress;   // quiet when standard error is no terminal
  std::stop_token stop;  // requested by SIGINT and SIGTERM
};

// What a finished command prints: `json` with --json, else `text`.
struct CommandOutput {
  Json json;
  std::string text;
  int exit_code = 0;  // of a command that has done its work and found something wanting
};

using CommandFn = std::function<Result<CommandOutput>(const CliContext&)>;

// A finite number above zero (CLI11's own check lets NaN pass and prints the largest double).
inline CLI::Validator Positive() {
  const auto check = [](const std::string& text) -> std::string {
    double value = 0;
    const bool good = CLI::detail::lexical_cast(text, value) && value > 0 && std::isfinite(value);
    return good ? "" : fmt::format("'{}' is not a positive number", text);
  };
  return CLI::Validator(check, "POSITIVE", "positive");
}

// Adds a subcommand; its options are bound by the caller to variables that `run` owns.
class CommandSet {
 public:
  explicit CommandSet(CLI::App& app) : app_(app) {}

  CLI::App& Add(const std::string& name, const std::string& description, CommandFn run) {
    return AddTo(app_, name, description, std::move(run));
  }

  // A subcommand that only holds others; null: at the top.
  CLI::App& AddGroup(CLI::App* parent, const std::string& name, const std::string& description) {
    CLI::App* group = (parent ? *parent : app_).add_subcommand(name, description);
    group->require_subcommand(1);
    return *group;
  }

  CLI::App& AddTo(CLI::App& parent, const std::string& name, const std::string& description,
                  CommandFn run) {
    CLI::App* command = parent.add_subcommand(name, description);
    command->add_flag("--json", json_, "machine-readable results on standard output");
    command->add_flag("-v,--verbose", verbose_, "more on standard error");
    command->callback([this, run = std::move(run)] { chosen_ = run; });
    return *command;
  }

  const CommandFn& chosen() const { return chosen_; }
  bool json() const { return json_; }
  bool verbose() const { return verbose_; }

 private:
  CLI::App& app_;
  CommandFn chosen_;
  bool json_ = false;
  bool verbose_ = false;
};

}  // namespace scan
