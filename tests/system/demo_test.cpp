// The main job end to end, scored against the truth.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "drivers/base/files.h"
#include "tests/support/temp_folder.h"
#include "tests/system/run_program.h"

namespace scan {
namespace {

TEST(Demo, CapturesReconstructsAndMeetsItsBars) {
  const TempFolder folder;
  const std::string out = (folder.path() / "demo").string();
  const ProgramRun run = RunProgram("scanstation", {"demo", "--json", "--out", out});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto result = nlohmann::json::parse(run.out);
  EXPECT_EQ(result["views"], 24);
  EXPECT_EQ(result["views_accepted"], 24);
  EXPECT_LE(result["centre_error_mm"]["max"], 1.0);
  EXPECT_LE(result["surface_error_px"]["median"], 1.0);
  EXPECT_GT(result["coverage"], 0.6);

  for (const char* file : {"session", "model", "report", "log"})
    EXPECT_TRUE(std::filesystem::exists(result[file].get<std::string>())) << file;
  const std::string model = ReadTextFile(result["model"].get<std::string>()).value();
  EXPECT_EQ(model.substr(0, 4), "glTF");
  const std::string report = ReadTextFile(result["report"].get<std::string>()).value();
  for (const char* words : {"24 of 24", "v000", "v023", "data:image/jpeg;base64,", "Time"})
    EXPECT_NE(report.find(words), std::string::npos) << words;
  EXPECT_EQ(report.find("src=\"http"), std::string::npos) << "self-contained";

  const ProgramRun verify =
      RunProgram("scanstation", {"verify", result["session"].get<std::string>()});
  EXPECT_EQ(verify.exit_code, 0) << verify.err;
  const ProgramRun again = RunProgram("scanstation", {"demo", "--out", out});
  EXPECT_EQ(again.exit_code, 2) << "an existing folder is not overwritten";
}

}  // namespace
}  // namespace scan
