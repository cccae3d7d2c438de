#include "drivers/base/files.h"

#include <gtest/gtest.h>

#include "drivers/base/sha256.h"
#include "drivers/base/staged_folder.h"
#include "tests/support/temp_folder.h"

namespace scan {
namespace {

TEST(Files, WritesWholeAndReadsBack) {
  TempFolder folder;
  ASSERT_TRUE(WriteFileDurably(folder.path() / "a.txt", std::string_view("one")));
  ASSERT_TRUE(WriteFileDurably(folder.path() / "a.txt", std::string_view("two")));
  EXPECT_EQ(ReadTextFile(folder.path() / "a.txt").value(), "two");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(Files, MissingFilesAndFoldersAreBadInput) {
  TempFolder folder;
  EXPECT_EQ(ReadTextFile(folder.path() / "none").error().kind, ErrorKind::bad_input);
  EXPECT_EQ(ReadTextFile(folder.path()).error().kind, ErrorKind::bad_input);
}

TEST(Files, AnUnwritablePlaceIsAnErrorAndLeavesNothing) {
  EXPECT_FALSE(WriteFileDurably("/proc/none/x", std::string_view("x")));
}

TEST(Files, AStagedFolderThatCannotTakeItsPlaceLeavesWhatWasThere) {
  TempFolder folder;
  const auto out = folder.path() / "out";
  ASSERT_TRUE(PrepareOutputFolder(out, false));
  ASSERT_TRUE(WriteFileDurably(out / "x", std::string_view("old")));
  auto staged = StagedFolder::Create(out, true);
  ASSERT_TRUE(staged);
  std::filesystem::remove(staged->path());  // now there is nothing to put there
  EXPECT_FALSE(staged->Commit());
  EXPECT_EQ(ReadTextFile(out / "x").value_or("lost"), "old");
}

TEST(Files, OutputFolderIsNotOverwrittenWithoutForce) {
  TempFolder folder;
  const auto out = folder.path() / "out";
  EXPECT_TRUE(PrepareOutputFolder(out, false));
  EXPECT_TRUE(PrepareOutputFolder(out, false)) << "an empty folder may be used";
  ASSERT_TRUE(WriteFileDurably(out / "x", std::string_view("x")));
  EXPECT_EQ(PrepareOutputFolder(out, false).error().kind, ErrorKind::bad_input);
  EXPECT_TRUE(PrepareOutputFolder(out, true));
  EXPECT_FALSE(PrepareOutputFile(out / "x", false));
  EXPECT_FALSE(PrepareOutputFile(out, true)) << "a folder is never replaced by a file";
}

TEST(StagedFolder, AppearsOnCommitAndOnlyThen) {
  TempFolder folder;
  const auto out = folder.path() / "out";
  {
    auto staged = StagedFolder::Create(out, false);
    ASSERT_TRUE(staged);
    ASSERT_TRUE(WriteFileDurably(staged->path() / "a", std::string_view("1")));
    EXPECT_FALSE(std::filesystem::exists(out));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "never committed: nothing stays";
  {
    auto staged = StagedFolder::Create(out, false);
    ASSERT_TRUE(WriteFileDurably(staged->path() / "a", std::string_view("1")));
    ASSERT_TRUE(staged->Commit());
  }
  EXPECT_TRUE(std::filesystem::exists(out / "a"));
  EXPECT_EQ(StagedFolder::Create(out, false).error().kind, ErrorKind::bad_input);
  {
    auto staged = StagedFolder::Create(out, true);
    ASSERT_TRUE(WriteFileDurably(staged->path() / "b", std::string_view("2")));
    ASSERT_TRUE(staged->Commit());
  }
  EXPECT_FALSE(std::filesystem::exists(out / "a")) << "force replaces the whole";
  EXPECT_TRUE(std::filesystem::exists(out / "b"));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(Files, Sha256OfTheEmptyStringAndOfAbc) {
  EXPECT_EQ(Sha256Hex(AsBytes("")),
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(Sha256Hex(AsBytes("abc")),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

}  // namespace
}  // namespace scan
