#include "drivers/station/station_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <sstream>

#include "drivers/base/files.h"

namespace scan {
namespace {

using ::testing::HasSubstr;

std::string ConfigFile(const std::string& name) {
  const auto text = ReadTextFile(std::string(SCAN_SOURCE_DIR "/configs/") + name);
  EXPECT_TRUE(text);
  return text.value_or("");
}
std::string DefaultFile() { return ConfigFile("station-sim.toml"); }

TEST(StationFile, TheDefaultFileSaysWhatTheDefaultsAre) {
  const auto read = LoadStationConfig(SCAN_SOURCE_DIR "/configs/station-sim.toml");
  ASSERT_TRUE(read) << ToString(read.error());
  const StationConfig expected = DefaultSimStation();
  EXPECT_EQ(read->name, expected.name);
  EXPECT_EQ(read->turntable, expected.turntable);
  EXPECT_EQ(read->lift, expected.lift);
  EXPECT_EQ(read->lift_geometry, expected.lift_geometry);
  EXPECT_EQ(read->cameras, expected.cameras);
  EXPECT_EQ(read->aims, expected.aims);
  EXPECT_EQ(read->plan.rings, expected.plan.rings);
  EXPECT_EQ(read->sim, expected.sim);
}

TEST(StationFile, AnEmptyFileIsTheDefaultStation) {
  const auto read = ParseStationConfig("", "empty.toml");
  ASSERT_TRUE(read);
  EXPECT_EQ(read->sim, DefaultSimStation().sim);
}

// Another value for each number must reach the structs, or the key is dead. The number of keys.
int CountKeysThatAreRead(const std::string& text) {
  std::istringstream lines(text);
  std::string line;
  int keys = 0;
  const std::regex assignment(R"(^([a-z_0-9]+) = .*$)");
  std::smatch match;
  while (std::getline(lines, line)) {
    if (!std::regex_match(line, match, assignment)) continue;
    ++keys;
    std::string broken = text;
    broken.replace(broken.find(line), line.size(), match[1].str() + " = 1979-05-27");
    const auto read = ParseStationConfig(broken, "broken.toml");
    EXPECT_FALSE(read) << line;
    if (read) continue;
    EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(read.error().what, HasSubstr(match[1].str())) << line;
  }
  return keys;
}

TEST(StationFile, EveryKeyIsReadAndEveryOneIsCommented) {
  EXPECT_GT(CountKeysThatAreRead(DefaultFile()), 90);
  EXPECT_GT(CountKeysThatAreRead(ConfigFile("station-uvc.toml")), 18);
  EXPECT_GT(CountKeysThatAreRead(ConfigFile("station-tic-uvc.toml")), 40);
  EXPECT_GT(CountKeysThatAreRead(ConfigFile("station-rpi5.toml")), 50);
  EXPECT_GT(CountKeysThatAreRead(ConfigFile("station-libcamera.toml")), 17);
  EXPECT_GT(CountKeysThatAreRead(ConfigFile("station-dslr.toml")), 30);
}

TEST(StationFile, AUsbCameraHasItsPortFormatAndControls) {
  const auto read = LoadStationConfig(SCAN_SOURCE_DIR "/configs/station-uvc.toml");
  ASSERT_TRUE(read) << ToString(read.error());
  const CameraConfig& camera = read->cameras.front();
  EXPECT_EQ(camera.driver, CameraDriver::v4l2);
  EXPECT_EQ(camera.w, 1920);
  V4l2Config expected;  // the file shows the defaults, but for what only a station can know
  expected.port = "0000:00:14.0/4";
  expected.pixel_format = "MJPG";
  expected.controls = {{"power_line_frequency", "50 Hz"}, {"white_balance_temperature", "5000"}};
  EXPECT_EQ(camera.v4l2, expected);
}

TEST(StationFile, ACameraOfLibcameraHasItsStreamAndControls) {
  const auto read = LoadStationConfig(SCAN_SOURCE_DIR "/configs/station-libcamera.toml");
  ASSERT_TRUE(read) << ToString(read.error());
  const CameraConfig& camera = read->cameras.front();
  EXPECT_EQ(camera.driver, CameraDriver::libcamera);
  LibcameraConfig expected;
  expected.camera = "imx477";
  expected.pixel_format = "RGB888";
  expected.latency_frames = 0;
  expected.controls = {{"AwbEnable", "false"}, {"Sharpness", "0.0"}};
  EXPECT_EQ(camera.libcamera, expected);
}

TEST(StationFile, ATetheredCameraHasItsPortQualityAndSettings) {
  const auto read = LoadStationConfig(SCAN_SOURCE_DIR "/configs/station-dslr.toml");
  ASSERT_TRUE(read) << ToString(read.error());
  const CameraConfig& camera = read->cameras.front();
  EXPECT_EQ(camera.driver, CameraDriver::ptp);
  PtpConfig expected;  // the file shows the defaults, but for what only a station can know
  expected.port = "1-2";
  expected.quality = "NEF+Fine";
  expected.f_number = 11;
  expected.settings = {{"whitebalance", "Daylight"}};
  EXPECT_EQ(camera.ptp, expected);
}

struct BadCase {
  const char* text;
  const char* what;
  const char* where;
};

class StationFileBad : public ::testing::TestWithParam<BadCase> {};

TEST_P(StationFileBad, IsRefusedWithFileLineAndMend) {
  const auto read = ParseStationConfig(GetParam().text, "s.toml");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(read.error().what, HasSubstr(GetParam().what));
  EXPECT_EQ(read.error().where, GetParam().where);
  EXPECT_FALSE(read.error().mend.empty());
}

INSTANTIATE_TEST_SUITE_P(
    Cases, StationFileBad,
    ::testing::Values(
        BadCase{"a = ", "", "s.toml:1"}, BadCase{"\nnme = 'x'", "unknown key nme", "s.toml:2"},
        BadCase{"[axis.turntable]\nspeed = 3", "unknown key axis.turntable.speed", "s.toml:2"},
        BadCase{"[axis.rotor]\nvelocity = 3", "unknown key axis.rotor", "s.toml:1"},
        BadCase{"[axis.lift]\nvelocity = 'fast'", "is not a number", "s.toml:2"},
        BadCase{"[axis.lift]\nvelocity = nan", "out of range", "s.toml:2"},
        BadCase{"[axis.lift]\nvelocity = inf", "out of range", "s.toml:2"},
        BadCase{"[axis.lift]\nvelocity = -1", "out of range", "s.toml:2"},
        BadCase{"[axis.lift]\n\nmin = 300", "min is not below max", "s.toml:3"},
        BadCase{"[axis.lift]\non_stop = 'release'", "would fall", "s.toml:2"},
        BadCase{"[axis.lift]\ndirection_in_station = [0, 0, 0.5]", "length", "s.toml:2"},
        BadCase{"[axis.lift]\ndirection_in_station = [0, 1]", "three numbers", "s.toml:2"},
        BadCase{"axis = 3", "is not a table", "s.toml:1"},
        BadCase{"camera = 3", "list of tables", "s.toml:1"},
        BadCase{"camera = []", "no camera", "s.toml:1"},
        BadCase{"[[camera]]\nid = 'C 0'", "is not an id", "s.toml:1"},
        BadCase{"[[aim]]\nid = 'a'\n[[aim]]\nid = 'a'", "twice", "s.toml:1"},
        BadCase{"[[aim]]\nid = 'a0'\nlift_mm = 900", "outside the lift's limits", "s.toml:1"},
        BadCase{"[[plan.rings]]\naim = 'zz'", "does not exist", "s.toml:1"},
        BadCase{"[[plan.rings]]\naim = 'a0'\ncount = 0", "out of range", "s.toml:3"},
        BadCase{"[[plan.rings]]\naim = 'a0'\ncount = 2.5", "whole number", "s.toml:3"},
        BadCase{"[[camera]]\ndriver = 'webcam'", "none of its words", "s.toml:2"},
        BadCase{"[[camera]]\n[camera.v4l2]\ndevice = 0", "unknown key camera.v4l2.device",
                "s.toml:3"},
        BadCase{"[[camera]]\n[camera.libcamera]\nrole = 'video'", "video", "s.toml:3"},
        BadCase{"[[camera]]\n[camera.ptp]\ntarget = 'cloud'", "none of its words", "s.toml:3"},
        BadCase{"[[camera]]\n[camera.v4l2.controls]\ngain = 1.5", "neither a whole number",
                "s.toml:3"},
        BadCase{"[sim]\nformat = 'bmp'", "none of its words", "s.toml:2"},
        BadCase{"[sim.errors]\nlevel = 'none'", "none of its words", "s.toml:2"},
        BadCase{"[motion]\ndriver = 'gpio'", "no step line", "s.toml:1"},
        BadCase{"[motion]\nemergency_stop = '!'", "is no line", "s.toml:2"},
        BadCase{"[light]\ndriver = 'gpio'", "no line", "s.toml:1"},
        BadCase{"[light]\ndriver = 'gpio'\nline = 'L'\nlevel = 0.5", "on or off", "s.toml:4"},
        BadCase{"[light]\ndriver = 'gpio'\nline = 'L'\nactive_low = true", "active_low",
                "s.toml:4"},
        BadCase{"[light]\ndriver = 'pwm'", "no PWM chip", "s.toml:1"},
        BadCase{"[light]\nlevel = 0", "out of range", "s.toml:2"},
        BadCase{"[motion]\npriority = 100", "out of range", "s.toml:2"},
        BadCase{"[axis.lift.gpio]\nstep = 4", "is not a text", "s.toml:2"},
        BadCase{"[axis.lift.gpio]\nsteps = 'A'", "unknown key axis.lift.gpio.steps", "s.toml:2"},
        BadCase{"[axis.turntable.homing]\nslow = 9", "above self_start", "s.toml:2"}));

TEST(StationFile, TheStationsOfRealLinesAreValidAndReadWhole) {
  const auto lab = LoadStationConfig(SCAN_SOURCE_DIR "/configs/station-lab.toml");
  ASSERT_TRUE(lab) << ToString(lab.error());
  EXPECT_EQ(lab->motion_driver, MotionDriver::gpio);
  EXPECT_EQ(lab->gpio.chip, "scan-lab");
  EXPECT_EQ(lab->gpio.emergency_stop, (GpioPin{"ESTOP", false, GpioBias::as_is}));
  EXPECT_EQ(lab->gpio.lift.enable, (GpioPin{"LIFT_EN", true, GpioBias::as_is}));
  EXPECT_EQ(lab->gpio.real_time.core, std::nullopt);
  EXPECT_EQ(lab->turntable.self_start * lab->turntable.steps_per_unit, 5000);
  const auto pi = LoadStationConfig(SCAN_SOURCE_DIR "/configs/station-rpi5.toml");
  ASSERT_TRUE(pi) << ToString(pi.error());
  EXPECT_EQ(pi->gpio.chip, "pinctrl-rp1");
  EXPECT_EQ(pi->gpio.emergency_stop.bias, GpioBias::pull_up);
  EXPECT_EQ(pi->gpio.motor_power, (GpioPin{"GPIO16", true, GpioBias::pull_up}));
  EXPECT_EQ(pi->light.driver, LightDriver::pwm);
  EXPECT_EQ(pi->light.chip, "1f00098000.pwm");
  EXPECT_EQ(pi->gpio.real_time.core, 3);
}

TEST(StationFile, AWiringMustFitTheAxis) {
  const std::string lab = ReadTextFile(SCAN_SOURCE_DIR "/configs/station-lab.toml").value();
  const auto refusal = [&](const std::string& from, const std::string& to) {
    std::string text = lab;
    text.replace(text.find(from), from.size(), to);
    const auto read = ParseStationConfig(text, "lab.toml");
    return read ? std::string() : read.error().what;
  };
  EXPECT_THAT(refusal("brake = \"LIFT_BRAKE\"", ""), HasSubstr("no brake is wired"));
  EXPECT_THAT(refusal("index = \"TURNTABLE_INDEX\"", ""), HasSubstr("no line"));
  EXPECT_THAT(refusal("pulse_us = 3.0", "pulse_us = 300.0"), HasSubstr("full velocity"));
  EXPECT_EQ(refusal("core = -1", "core = 1"), "");
}

TEST(StationFile, ATmc2209MustBeSetUpAsItCanBe) {
  const std::string pi = ReadTextFile(SCAN_SOURCE_DIR "/configs/station-rpi5.toml").value();
  const auto read = ParseStationConfig(pi, "pi");
  ASSERT_TRUE(read) << ToString(read.error());
  EXPECT_EQ(read->lift_tmc2209.address, 1);
  EXPECT_EQ(read->turntable_tmc2209.run_ma, 800);
  const std::pair<const char*, const char*> cases[] = {{"microsteps = 16", "microsteps = 12"},
                                                       {"run_ma = 800.0", "run_ma = 2500.0"},
                                                       {"hold_ma = 400.0", "hold_ma = 900.0"},
                                                       {"address = 1", "address = 0"}};
  for (const auto& [from, to] : cases) {
    std::string broken = pi;
    broken.replace(broken.find(from), std::string_view(from).size(), to);
    const auto refused = ParseStationConfig(broken, "pi");
    ASSERT_FALSE(refused) << to;
    EXPECT_THAT(refused.error().what, HasSubstr("tmc2209"));
  }
}

TEST(StationFile, ATicStationIsReadWhole) {
  const auto read = LoadStationConfig(SCAN_SOURCE_DIR "/configs/station-tic-uvc.toml");
  ASSERT_TRUE(read) << ToString(read.error());
  EXPECT_EQ(read->motion_driver, MotionDriver::tic);
  EXPECT_EQ(read->cameras.front().driver, CameraDriver::v4l2);
  TicMotionConfig expected;
  expected.turntable = {"00123456", "", 16};
  expected.lift = {"00123457", "", 16};
  EXPECT_EQ(read->tic, expected);
  for (const RingConfig& ring : read->plan.rings) {
    const double last_deg = ring.start_deg + 360.0 * (ring.count - 1) / ring.count;
    EXPECT_LE(last_deg, *read->turntable.max) << "the plan stays this side of the switch";
  }
}

TEST(StationFile, ATicBoardMustFitItsAxis) {
  const std::string whole = ConfigFile("station-tic-uvc.toml");
  const auto refusal = [&](const std::string& from, const std::string& to) {
    std::string text = whole;
    text.replace(text.find(from), from.size(), to);
    const auto read = ParseStationConfig(text, "tic.toml");
    return read ? std::string() : read.error().what;
  };
  EXPECT_EQ(refusal("port = \"\"", "port = \"1-2.3\""), "");
  EXPECT_THAT(refusal("serial = \"00123456\"", "serial = \"\""), HasSubstr("no board"));
  EXPECT_THAT(refusal("serial = \"00123457\"", "serial = \"00123456\""), HasSubstr("same board"));
  EXPECT_THAT(refusal("microsteps = 16", "microsteps = 10"), HasSubstr("10 microsteps"));
  EXPECT_THAT(refusal("velocity = 30.0", "velocity = 3000.0"), HasSubstr("50000"));
  EXPECT_THAT(refusal("kind = \"endstop\"", "kind = \"index\""), HasSubstr("limit switch only"));
  EXPECT_THAT(refusal("approach = \"positive\"", "approach = \"negative\""),
              HasSubstr("last approach"));
  EXPECT_THAT(refusal("on_stop = \"release\"", "on_stop = \"brake\""), HasSubstr("no brake"));
  EXPECT_THAT(refusal("poll_ms = 5.0", "poll_ms = 0.0"), HasSubstr("out of range"));
}

TEST(StationFile, AFileThatIsNotThereIsBadInput) {
  const auto read = LoadStationConfig("/nonexistent/station.toml");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
}

TEST(StationFile, AnyTruncationIsReadOrRefused) {
  const std::string text = DefaultFile();
  for (std::size_t length = 0; length < text.size(); length += 37) {
    const auto read = ParseStationConfig(text.substr(0, length), "cut.toml");
    if (!read) {
      EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
    }
  }
}

TEST(StationFile, ALevelIsSetFirstAndThenOverridden) {
  const auto read = ParseStationConfig("[sim.errors]\nrunout_mm = 0.2\nlevel = 'ideal'", "s.toml");
  ASSERT_TRUE(read) << ToString(read.error());
  SimErrors expected = DefaultSimErrors(ErrorLevel::ideal);
  expected.runout_mm = 0.2;
  EXPECT_EQ(read->sim.errors, expected);
}

}  // namespace
}  // namespace scan
