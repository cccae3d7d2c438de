// Disk faults, power cuts and altered bytes.
#include <gtest/gtest.h>

#include <functional>

#include "acquisition/session/photo_set.h"
#include "acquisition/session/session_verify.h"
#include "drivers/base/files.h"
#include "drivers/base/rng.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/session/session_samples.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

// Fails the operation `fail_at` (counted from 0) and all that follow, as a disk that goes away; an
// append that fails leaves half of its line.
class FaultySink final : public SessionSink {
 public:
  FaultySink(fs::path folder, int fail_at) : disk_(folder), folder_(folder), fail_at_(fail_at) {}

  Status CreateFolder(const fs::path& folder) override {
    if (Fails()) return Gone();
    return disk_.CreateFolder(folder);
  }
  Status WriteFile(const fs::path& file, std::span<const std::byte> bytes) override {
    if (Fails()) return Gone();
    return disk_.WriteFile(file, bytes);
  }
  Status AppendToLog(std::string_view line) override {
    if (Fails()) {
      std::ofstream(folder_ / "log.jsonl", std::ios::app) << line.substr(0, line.size() / 2);
      return Gone();
    }
    return disk_.AppendToLog(line);
  }
  Status CutLog(std::uint64_t bytes) override {
    if (Fails()) return Gone();
    return disk_.CutLog(bytes);
  }

 private:
  bool Fails() { return count_++ >= fail_at_; }
  static Status Gone() { return Failed("no space left", "disk", "make room"); }

  FolderSink disk_;
  fs::path folder_;
  int fail_at_;
  int count_ = 0;
};

Status Capture(std::unique_ptr<SessionSink> sink) {
  SCAN_TRY(SessionWriter writer, SessionWriter::Create(std::move(sink), SampleDocument(), Time(0)));
  return WriteSampleLog(writer);
}

TEST(SessionDamage, AnyFailedOperationLeavesAShorterSession) {
  int fail_at = 0;
  for (;; ++fail_at) {
    const TempFolder temp;
    const fs::path folder = temp.path() / "session";
    const bool whole = Capture(std::make_unique<FaultySink>(folder, fail_at)).has_value();
    if (!fs::exists(folder / "session.json")) {
      EXPECT_FALSE(ReadSession(folder));
      continue;
    }
    const auto report = VerifySession(folder);
    ASSERT_TRUE(IsOk(report));
    EXPECT_TRUE(report->sound()) << fail_at << ": " << ToString(report->problems.front());
    if (whole) {
      EXPECT_EQ(report->views_complete.size(), 2u);
      break;
    }
    // And it can be gone on with: the views that lack a frame are taken.
    auto writer = ResumeSession(folder, Time(100));
    ASSERT_TRUE(IsOk(writer)) << fail_at;
    for (const auto& view : SampleDocument().views)
      if (!writer->state().Frame(view.id, 0)) {
        const std::vector<EncodedFile> pictures = {{"png", SamplePng(16, 12, 50)}};
        EXPECT_TRUE(IsOk(writer->AppendFrame(SampleFrame(view), pictures, Time(101))));
      }
    const auto resumed = VerifySession(folder);
    ASSERT_TRUE(IsOk(resumed));
    EXPECT_TRUE(resumed->sound()) << fail_at;
    EXPECT_TRUE(resumed->views_missing.empty());
  }
  EXPECT_GT(fail_at, 10);
}

TEST(SessionDamage, AWriterThatFailedOnceWritesNoMore) {
  const TempFolder temp;
  auto writer = SessionWriter::Create(std::make_unique<FaultySink>(temp.path() / "s", 6),
                                      SampleDocument(), Time(0));
  ASSERT_TRUE(IsOk(writer));
  EXPECT_FALSE(writer->Append(NoteEntry{"first", {}, {}}, Time(1)));
  const auto second = writer->Append(NoteEntry{"second", {}, {}}, Time(1));
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().mend, "resume the session");
}

TEST(SessionDamage, ResumesAfterALineTornAtEveryByte) {
  const TempFolder temp;
  const fs::path folder = temp.path() / "session";
  ASSERT_TRUE(IsOk(WriteSampleSession(folder)));
  const std::string log = ReadTextFile(folder / "log.jsonl").value();
  const std::size_t last = log.rfind('\n', log.size() - 2) + 1;  // the end document
  const std::size_t frame = log.rfind('\n', last - 2) + 1;       // the last frame
  for (std::size_t cut = frame; cut < log.size(); ++cut) {
    WriteText(folder / "log.jsonl", log.substr(0, cut));
    const std::size_t whole = cut < last ? frame : last;
    {
      const auto session = ReadSession(folder);
      ASSERT_TRUE(IsOk(session)) << cut;
      ASSERT_EQ(session->log_bytes, whole);
      ASSERT_EQ(session->torn_bytes, cut - whole);
    }
    if (cut % 41 != 0 && cut != last) continue;  // each resume is synced to disk
    auto writer = ResumeSession(folder, Time(50));
    ASSERT_TRUE(IsOk(writer));
    ASSERT_EQ(writer->state().next_seq(), cut < last ? 4 : 5);
    ASSERT_TRUE(IsOk(writer->Append(ResumeEntry{"power"}, Time(51))));
    const auto report = VerifySession(folder);
    ASSERT_TRUE(IsOk(report));
    ASSERT_TRUE(report->sound()) << cut << ToString(report->problems.front());
  }
}

TEST(SessionDamage, AnyAlteredByteBeforeTheLastLineIsFound) {
  const TempFolder temp;
  const fs::path folder = temp.path() / "session";
  ASSERT_TRUE(IsOk(WriteSampleSession(folder)));
  const std::string log = ReadTextFile(folder / "log.jsonl").value();
  const std::size_t last = log.rfind('\n', log.size() - 2) + 1;
  for (std::size_t at = 0; at < last; ++at) {
    std::string altered = log;
    altered[at] = static_cast<char>(altered[at] ^ 1);
    WriteText(folder / "log.jsonl", altered);
    const auto session = ReadSession(folder);
    ASSERT_FALSE(session) << at;
    ASSERT_NE(session.error().where.find("log.jsonl line "), std::string::npos);
  }
}

TEST(SessionVerify, FindsEveryKindOfDamage) {
  const TempFolder temp;
  const fs::path folder = temp.path() / "session";
  const auto damaged = [&](const std::function<void()>& damage) {
    fs::remove_all(folder);
    EXPECT_TRUE(IsOk(WriteSampleSession(folder)));
    damage();
    return VerifySession(folder).value();
  };
  EXPECT_TRUE(damaged([] {}).sound());
  const auto altered = damaged([&] {
    auto bytes = ReadBinaryFile(folder / "frames/v000_c0.png").value();
    bytes[bytes.size() / 2] ^= std::byte{1};
    EXPECT_TRUE(WriteFileDurably(folder / "frames/v000_c0.png", bytes));
  });
  ASSERT_EQ(altered.problems.size(), 1u);
  EXPECT_NE(altered.problems[0].where.find("v000_c0.png"), std::string::npos);
  EXPECT_EQ(damaged([&] { fs::remove(folder / "plates/background_a0_c0.png"); }).problems.size(),
            1u);
  EXPECT_EQ(damaged([&] { fs::resize_file(folder / "frames/v001_c0.png", 9); }).problems.size(),
            1u);
  EXPECT_FALSE(damaged([&] { WriteText(folder / "session.json", "{}"); }).sound());
  const auto edited = damaged([&] {
    SessionDocument other = SampleDocument();
    other.specimen["dwc:catalogNumber"] = "S-2";
    WriteText(folder / "session.json", SerialiseSessionDocument(other).value());
  });
  ASSERT_EQ(edited.problems.size(), 1u);
  EXPECT_NE(edited.problems[0].where.find("session_sha256"), std::string::npos);
  const auto rejected = damaged([&] {
    auto writer = ResumeSession(folder, Time(90));
    ASSERT_TRUE(IsOk(writer));
    RejectEntry reject;
    reject.view = "v000";
    reject.camera = "c0";
    const std::vector<EncodedFile> pictures = {{"png", SamplePng(16, 12, 3)}};
    ASSERT_TRUE(IsOk(writer->AppendReject(reject, pictures, Time(91))));
    int removed = 0;
    for (const auto& file : fs::directory_iterator(folder / "frames"))
      if (file.path().filename().string().starts_with("rejected_"))
        removed += fs::remove(file.path());
    EXPECT_EQ(removed, 1);
  });
  EXPECT_EQ(rejected.problems.size(), 1u);
  const auto no_log = damaged([&] { fs::remove(folder / "log.jsonl"); });
  EXPECT_TRUE(no_log.sound());
  EXPECT_EQ(no_log.views_missing.size(), 2u);
  const auto stranger = damaged([&] { WriteText(folder / "frames/cat.png", "meow"); });
  EXPECT_TRUE(stranger.sound());
  ASSERT_EQ(stranger.notes.size(), 1u);
  EXPECT_EQ(VerifySession(temp.path() / "none").error().kind, ErrorKind::bad_input);
}

std::string Mutated(std::string text, Rng& rng) {
  for (std::uint64_t edits = 1 + rng.Below(3); edits > 0; --edits) {
    const std::size_t at = rng.Below(text.size());
    const std::uint64_t kind = rng.Below(4);
    if (kind == 0) text.erase(at, 1 + rng.Below(60));
    if (kind == 1) text[at] = static_cast<char>(rng.Below(256));
    if (kind == 2) text.insert(at, text.substr(rng.Below(text.size()), rng.Below(60)));
    if (kind == 3) text.replace(at, 1, rng.Below(2) ? "-1e308" : "null");
    if (text.empty()) text = " ";
  }
  return text;
}

TEST(SessionDamage, NoMutationCrashes) {
  const TempFolder temp;
  const fs::path folder = temp.path() / "session";
  ASSERT_TRUE(IsOk(WriteSampleSession(folder)));
  const std::string document = ReadTextFile(folder / "session.json").value();
  const std::string log = ReadTextFile(folder / "log.jsonl").value();
  Rng rng(1);
  int refused = 0;
  for (int round = 0; round < 2000; ++round) {
    const auto parsed = ParseSessionDocument(Mutated(document, rng), "S");
    if (!parsed)
      EXPECT_EQ(parsed.error().kind, ErrorKind::bad_input);
    else
      EXPECT_TRUE(IsOk(SerialiseSessionDocument(*parsed)));
    refused += !parsed;
    // Each line alone, where no chain protects it.
    std::size_t begin = 0;
    while (rng.Below(3) != 0 && log.find('\n', begin) + 1 < log.size())
      begin = log.find('\n', begin) + 1;
    const auto entry =
        ParseLogEntry(Mutated(log.substr(begin, log.find('\n', begin) - begin), rng), "L");
    if (!entry) continue;
    EXPECT_TRUE(IsOk(SerialiseLogEntry(*entry)));
    SessionState state(SampleDocument());
    (void)state.Apply(*entry, "L");
  }
  EXPECT_GT(refused, 1000);
  for (int round = 0; round < 500; ++round) {
    SessionState state(SampleDocument());
    const LogReading reading = ReadLog(Mutated(log, rng), std::string(64, '0'), state);
    EXPECT_LE(reading.damage.size(), 1u);
  }
}

TEST(GoldenSession, ReadsAndVerifies) {
  const fs::path golden = fs::path(SCAN_SOURCE_DIR) / "tests/golden/session";
  const auto report = VerifySession(golden);
  ASSERT_TRUE(IsOk(report));
  EXPECT_TRUE(report->sound());
  EXPECT_TRUE(report->notes.empty());
  EXPECT_EQ(report->views_complete, (std::vector<std::string>{"v000", "v001"}));
  EXPECT_EQ(report->files_checked, 3u);
  // The bytes of today's writer for the same content.
  const TempFolder temp;
  ASSERT_TRUE(IsOk(WriteSampleSession(temp.path() / "session")));
  EXPECT_EQ(ReadTextFile(golden / "session.json").value(),
            ReadTextFile(temp.path() / "session/session.json").value());
  const auto set = LoadPhotoSet(golden);
  ASSERT_TRUE(IsOk(set));
  EXPECT_EQ(set->photos.size(), 2u);
}

}  // namespace
}  // namespace scan
