// scanstationd and its client as separate programs, over their socket and the loopback page.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "drivers/base/files.h"
#include "tests/support/temp_folder.h"
#include "tests/system/run_program.h"

namespace scan {
namespace {

// A scanstationd with a small plan, for the life of a test.
class StationProgram {
 public:
  StationProgram(const std::filesystem::path& folder, const std::string& station_file)
      : socket_((folder / "s.sock").string()) {
    const std::string config = (folder / "station.toml").string();
    EXPECT_TRUE(WriteFileDurably(config, std::string_view(station_file)));
    pid_ = ::fork();
    if (pid_ == 0) {
      const std::string program = std::string(SCAN_BIN_DIR) + "/scanstationd";
      ::execl(program.c_str(), "scanstationd", "--config", config.c_str(), "--socket",
              socket_.c_str(), "--page-port", "-1", nullptr);
      ::_exit(127);
    }
    for (int i = 0; i < 600 && Call({"status"}).exit_code != 0; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  ~StationProgram() { EXPECT_EQ(End(), 0) << "ends cleanly on SIGTERM"; }

  ProgramRun Call(std::vector<std::string> arguments) const {
    arguments.push_back("--socket");
    arguments.push_back(socket_);
    return RunProgram("scanstation", arguments);
  }

 private:
  int End() {
    ::kill(pid_, SIGTERM);
    int status = -1;
    ::waitpid(pid_, &status, 0);
    return status;
  }
  std::string socket_;
  pid_t pid_ = -1;
};

constexpr char kSmallStation[] =
    "name = \"small\"\n[sim]\nspecimen = \"tomato\"\n[[plan.rings]]\naim = \"a0\"\ncount = 3\n";

TEST(StationPrograms, CaptureStatusVerifyReplay) {
  const TempFolder folder;
  const StationProgram station(folder.path(), kSmallStation);
  const std::string session = (folder.path() / "session").string();
  const ProgramRun capture = station.Call({"capture", "--out", session});
  ASSERT_EQ(capture.exit_code, 0) << capture.err;
  const auto status = nlohmann::json::parse(station.Call({"status", "--json"}).out);
  EXPECT_EQ(status["state"], "idle");
  EXPECT_EQ(status["outcome"], "complete");
  EXPECT_EQ(status["views_accepted"], 3);
  EXPECT_EQ(RunProgram("scanstation", {"verify", session}).exit_code, 0);
  const ProgramRun replay =
      RunProgram("scanstation", {"replay", session, "--out", (folder.path() / "again").string()});
  EXPECT_EQ(replay.exit_code, 0) << replay.err;
  EXPECT_EQ(station.Call({"capture", "--out", session}).exit_code, 2)
      << "an existing session is not overwritten";
}

TEST(StationPrograms, StopEndsACaptureThatResumeCompletes) {
  const TempFolder folder;
  const StationProgram station(folder.path(), kSmallStation);
  const std::string session = (folder.path() / "session").string();
  ProgramRun capture;
  std::thread capturing([&] { capture = station.Call({"capture", "--out", session}); });
  for (int i = 0; i < 400; ++i) {
    const auto status = nlohmann::json::parse(station.Call({"status", "--json"}).out);
    if (status["state"] == "capturing" && status["views_accepted"] >= 1) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_EQ(station.Call({"stop"}).exit_code, 0);
  capturing.join();
  EXPECT_EQ(capture.exit_code, 3) << capture.err;
  EXPECT_EQ(RunProgram("scanstation", {"verify", session}).exit_code, 0);
  const ProgramRun resumed = station.Call({"resume", session});
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  const auto verify =
      nlohmann::json::parse(RunProgram("scanstation", {"verify", session, "--json"}).out);
  EXPECT_EQ(verify["views_complete"].size(), 3u);
}

TEST(StationPrograms, NobodyAnswers) {
  const ProgramRun run = RunProgram("scanstation", {"status", "--socket", "/nonexistent/s.sock"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("scanstationd"), std::string::npos);
}

}  // namespace
}  // namespace scan
