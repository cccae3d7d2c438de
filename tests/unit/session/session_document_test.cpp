#include "acquisition/session/session_document.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <nlohmann/json.hpp>

#include "acquisition/session/log_document.h"
#include "tests/unit/session/session_samples.h"

namespace scan {
namespace {

using nlohmann::json;

// Where the error says the damaged document is wrong; empty when it is taken.
std::string WhereWrong(const std::function<void(json&)>& damage) {
  json document = json::parse(SerialiseSessionDocument(SampleDocument()).value());
  damage(document);
  const auto parsed = ParseSessionDocument(document.dump(), "S");
  if (parsed) return "";
  EXPECT_EQ(parsed.error().kind, ErrorKind::bad_input);
  EXPECT_FALSE(parsed.error().mend.empty());
  return parsed.error().where;
}

TEST(SessionDocument, WritingWhatWasReadKeepsTheBytes) {
  const std::string text = SerialiseSessionDocument(SampleDocument()).value();
  const auto parsed = ParseSessionDocument(text, "S");
  ASSERT_TRUE(IsOk(parsed));
  EXPECT_EQ(SerialiseSessionDocument(*parsed).value(), text);
}

TEST(SessionDocument, DamageIsNamedByItsField) {
  EXPECT_EQ(WhereWrong([](json& d) { d["schema"] = "scanstation.session/2"; }), "S: schema");
  EXPECT_EQ(WhereWrong([](json& d) { d.erase("id"); }), "S: id");
  EXPECT_EQ(WhereWrong([](json& d) { d["id"] = "A b"; }), "S: id");
  EXPECT_EQ(WhereWrong([](json& d) { d["created_utc_ns"] = 1.5; }), "S: created_utc_ns");
  EXPECT_EQ(WhereWrong([](json& d) { d["ct"]["voxel_mm"] = {1, 2}; }), "S: ct.voxel_mm");
  EXPECT_EQ(WhereWrong([](json& d) { d["station"]["lift"]["kind"] = "rope"; }),
            "S: station.lift.kind");
  EXPECT_EQ(WhereWrong([](json& d) { d["station"]["lift"]["direction_in_station"][2] = 2; }),
            "S: station.lift.direction_in_station");
  EXPECT_EQ(WhereWrong([](json& d) { d["station"]["axes"]["turntable"]["unit"] = "rad"; }),
            "S: station.axes.turntable.unit");
  EXPECT_EQ(WhereWrong([](json& d) { d["station"]["cameras"][0]["fl_x"] = "long"; }),
            "S: station.cameras[0].fl_x");
  EXPECT_EQ(WhereWrong([](json& d) { d["station"]["cameras"][0]["w"] = 0; }),
            "S: station.cameras[0].w");
  EXPECT_EQ(
      WhereWrong([](json& d) { d["station"]["cameras"][0]["camera_from_lift"]["a0"][1][1] = 2; }),
      "S: station.cameras[0].camera_from_lift.a0");
  EXPECT_EQ(WhereWrong([](json& d) { d["views"][1]["id"] = "v000"; }), "S: views[1].id");
  EXPECT_EQ(WhereWrong([](json& d) { d["views"][1]["camera"] = "c9"; }), "S: views[1].camera");
  EXPECT_EQ(WhereWrong([](json& d) { d["views"][1]["aim_id"] = "a9"; }), "S: views[1].aim_id");
  EXPECT_EQ(WhereWrong([](json& d) { d["views"][0]["slices"] = 0; }), "S: views[0].slices");
  EXPECT_EQ(WhereWrong([](json& d) { d["views"] = 3; }), "S: views");
  EXPECT_EQ(WhereWrong([](json& d) { d["a_later_key"] = 3; }), "");
}

TEST(SessionDocument, TextThatIsNoJsonIsBadInput) {
  for (const char* text : {"", "{", "[]", "{\"schema\":NaN}", "{\"schema\":1e999}", "\xff"})
    EXPECT_EQ(ParseSessionDocument(text, "S").error().kind, ErrorKind::bad_input) << text;
}

TEST(SessionDocument, RefusesToWriteWhatCouldNotBeRead) {
  SessionDocument document = SampleDocument();
  document.station.cameras[0].intrinsics.k1 = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(SerialiseSessionDocument(document));
  document = SampleDocument();
  document.views[1].id = document.views[0].id;
  EXPECT_FALSE(SerialiseSessionDocument(document));
}

TEST(LogDocument, EveryTypeReadsBack) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(0.1, 0.2, 1.0 / 3);
  FrameEntry frame = SampleFrame(SampleDocument().views[1]);
  frame.files = {{"frames/v001_c0.png", 12, std::string(64, 'a')},
                 {"frames/v001_c0.nef", 13, std::string(64, 'b')}};
  frame.camera_from_table = CameraFromTable(pose);
  frame.prior_sigma_view = {0.1, 0.2};
  const FileDocument picture = {"frames/rejected_v001_c0_0.png", 12, std::string(64, 'd')};
  const RejectEntry reject = {"v001",
                              "",
                              "c0",
                              0,
                              "blurred \"badly\"\n",
                              "settings",
                              {picture},
                              5,
                              ExposureBound{1, 2},
                              AppliedSettings{900.0, {}}};
  const FaultEntry fault = {"motion",          "lost steps", "home", "axis",
                            ErrorKind::device, "v001",       "move"};
  const PlateDocument plate = {PlateKind::chart,   "c0", "", {frame.files[0]}, {}, 8,
                               ExposureBound{3, 4}};
  const std::vector<LogPayload> payloads = {
      StartEntry{std::string(64, '0')},
      HomeEntry{2, SamplePosition()},
      MoveEntry{"v001", {15, 120.5, "a1"}},
      SettleEntry{77, SamplePosition()},
      frame,
      reject,
      RetryEntry{"v001", "c0", 0, 2, "late"},
      RetakeEntry{4, "v001", "c0", 0, "dust"},
      PlanExtendEntry{SampleDocument().views},
      MountEntry{"m1", "upside down"},
      AimEntry{"a2", "c0", CameraFromLift(pose), PriorSigma{1, 2}},
      PauseEntry{"lunch"},
      ResumeEntry{"done"},
      StopEntry{StopKind::emergency_stop, "smoke"},
      fault,
      NoteEntry{"a plate", plate, {{"key", "value"}}},
      EndEntry{EndResult::stopped, "enough"}};
  ASSERT_EQ(payloads.size(), std::variant_size_v<LogPayload>);
  for (std::size_t i = 0; i < payloads.size(); ++i) {
    ASSERT_EQ(payloads[i].index(), i);
    const LogEntry entry{3, Time(9), std::string(64, 'c'), payloads[i]};
    const auto line = SerialiseLogEntry(entry);
    ASSERT_TRUE(IsOk(line));
    EXPECT_EQ(line->find('\n'), line->npos);
    const auto read = ParseLogEntry(*line, "L");
    ASSERT_TRUE(IsOk(read)) << *line;
    EXPECT_EQ(read->payload.index(), i);
    EXPECT_EQ(SerialiseLogEntry(*read).value(), *line);
  }
  const std::string line = SerialiseLogEntry({3, Time(9), std::string(64, 'c'), frame}).value();
  const auto read = ParseLogEntry(line, "L").value();
  EXPECT_EQ(read.time, Time(9));
  const auto& back = std::get<FrameEntry>(read.payload);
  EXPECT_EQ(back.files, frame.files);
  EXPECT_EQ(back.axes, frame.axes);
  EXPECT_EQ(back.applied, frame.applied);
  EXPECT_EQ(back.exposure, frame.exposure);
  EXPECT_EQ(back.camera_from_table->matrix34(), frame.camera_from_table->matrix34());
}

TEST(LogDocument, APathOutOfTheSessionIsRefused) {
  for (const char* path : {"../x.png", "/etc/x.png", "frames/../../x.png", "frames/.x.png",
                           "frames/x", "frames/x.exe", "derived/x.png", "frames/"}) {
    FrameEntry frame = SampleFrame(SampleDocument().views[0]);
    frame.files = {{path, 1, std::string(64, 'a')}};
    const std::string line = SerialiseLogEntry({0, Time(0), std::string(64, '0'), frame}).value();
    const auto read = ParseLogEntry(line, "L");
    ASSERT_FALSE(read) << path;
    EXPECT_EQ(read.error().where, "L: files[0].path");
  }
}

}  // namespace
}  // namespace scan
