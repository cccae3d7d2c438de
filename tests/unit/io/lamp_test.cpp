// Lamps on lines and on PWM outputs: one contract for all of them, and what each has beside it.
#include "drivers/io/lamp.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "drivers/base/files.h"
#include "drivers/io/gpio/gpio_lamp.h"
#include "drivers/io/gpio/sim_gpio_board.h"
#include "drivers/io/pwm/pwm_lamp.h"
#include "drivers/io/pwm/sim_pwm.h"
#include "tests/support/temp_folder.h"

namespace scan {
namespace {

using ::testing::HasSubstr;

struct LampTwin {
  std::shared_ptr<void> world;  // destroyed last
  std::unique_ptr<Lamp> lamp;
  std::function<double()> brightness;  // as the room sees it
  std::function<void()> fail;          // whatever is asked of the device from now on
  bool dims = false;
};

LampTwin OnALine(bool active_low) {
  const auto board =
      std::make_shared<SimGpioBoard>("board", std::vector<std::string>{"LAMP"},
                                     std::make_shared<SystemClock>(), GpioAfterExit::kept);
  LampTwin twin;
  twin.world = board;
  twin.lamp = OpenGpioLamp(board->Opener(), "board", {"LAMP", active_low}).value();
  twin.brightness = [board, active_low] { return board->Level("LAMP") != active_low ? 1.0 : 0.0; };
  twin.fail = [board] { board->FailAt(1); };
  return twin;
}

LightConfig OnPwm(bool active_low) {
  LightConfig config;
  config.driver = LightDriver::pwm;
  config.chip = "1f00098000.pwm";
  config.channel = 1;
  config.active_low = active_low;
  return config;
}

LampTwin OnAPwmOutput(bool active_low) {
  const auto chip = std::make_shared<SimPwm>("1f00098000.pwm", 2);
  LampTwin twin;
  twin.world = chip;
  twin.lamp = OpenPwmLamp(OnPwm(active_low), chip, std::make_shared<SystemClock>()).value();
  twin.brightness = [chip, active_low] {
    return active_low ? 1 - chip->Brightness(1) : chip->Brightness(1);
  };
  twin.fail = [chip] { chip->FailAt(1); };
  twin.dims = true;
  return twin;
}

struct LampFactory {
  std::string name;
  std::function<LampTwin()> make;
  friend std::ostream& operator<<(std::ostream& out, const LampFactory& factory) {
    return out << factory.name;
  }
};

class LampContract : public ::testing::TestWithParam<LampFactory> {
 protected:
  LampTwin twin = GetParam().make();
};

TEST_P(LampContract, IsDarkUntilAskedAndFollowsEveryLevel) {
  EXPECT_EQ(twin.brightness(), 0);
  for (const double level : {1.0, 1.0, 0.0, 0.0, 1.0}) {
    const Status set = twin.lamp->SetLevel(level);
    ASSERT_TRUE(set) << ToString(set.error());
    EXPECT_EQ(twin.brightness(), level);
  }
}

TEST_P(LampContract, ALevelBetweenIsGivenOrRefused) {
  ASSERT_TRUE(twin.lamp->SetLevel(1));
  const Status set = twin.lamp->SetLevel(0.25);
  ASSERT_EQ(set.has_value(), twin.dims);
  EXPECT_EQ(twin.brightness(), twin.dims ? 0.25 : 1);
  if (!set) {
    EXPECT_EQ(set.error().kind, ErrorKind::bad_input);
  }
}

TEST_P(LampContract, ALevelThatIsNoneChangesNothing) {
  ASSERT_TRUE(twin.lamp->SetLevel(1));
  for (const double level : {-0.1, 1.1, std::nan(""), std::numeric_limits<double>::infinity()}) {
    const Status set = twin.lamp->SetLevel(level);
    ASSERT_FALSE(set) << level;
    EXPECT_EQ(set.error().kind, ErrorKind::bad_input);
    EXPECT_EQ(twin.brightness(), 1);
  }
}

TEST_P(LampContract, ADeviceThatFailsIsNamed) {
  twin.fail();
  const Status set = twin.lamp->SetLevel(1);
  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().kind, ErrorKind::device);
  EXPECT_FALSE(set.error().where.empty() || set.error().mend.empty());
}

TEST_P(LampContract, IsDarkWhenItGoes) {
  ASSERT_TRUE(twin.lamp->SetLevel(1));
  twin.lamp.reset();
  EXPECT_EQ(twin.brightness(), 0);
}

INSTANTIATE_TEST_SUITE_P(
    Twins, LampContract,
    ::testing::Values(LampFactory{"line", [] { return OnALine(false); }},
                      LampFactory{"active_low_line", [] { return OnALine(true); }},
                      LampFactory{"pwm", [] { return OnAPwmOutput(false); }},
                      LampFactory{"active_low_pwm", [] { return OnAPwmOutput(true); }}),
    [](const auto& instance) { return instance.param.name; });

class PwmLampTest : public ::testing::Test {
 protected:
  Result<std::unique_ptr<Lamp>> Open(const LightConfig& config = OnPwm(false)) {
    return OpenPwmLamp(config, chip, std::make_shared<SystemClock>());
  }
  std::shared_ptr<SimPwm> chip = std::make_shared<SimPwm>("1f00098000.pwm", 2);
};

// A chip whose outputs are looked at after every write.
class WatchedPwm final : public PwmFiles {
 public:
  WatchedPwm(std::shared_ptr<SimPwm> chip, bool active_low)
      : chip_(std::move(chip)), active_low_(active_low) {}
  std::vector<PwmChip> Chips() override { return chip_->Chips(); }
  tl::expected<std::string, int> Read(const std::string& attribute) override {
    return chip_->Read(attribute);
  }
  int Write(const std::string& attribute, const std::string& value) override {
    const int error = chip_->Write(attribute, value);
    const double high = chip_->Brightness(1);
    brightest = std::max(brightest, active_low_ ? 1 - high : high);
    return error;
  }
  double brightest = 0;

 private:
  std::shared_ptr<SimPwm> chip_;
  const bool active_low_;
};

// As a program left it that had this period, with the output high for `duty`.
std::shared_ptr<SimPwm> LeftChip(const char* polarity, const char* period, const char* duty) {
  const auto chip = std::make_shared<SimPwm>("1f00098000.pwm", 2);
  EXPECT_EQ(chip->Write("pwmchip0/export", "1"), 0);
  EXPECT_EQ(chip->Write("pwmchip0/pwm1/period", period), 0);
  EXPECT_EQ(chip->Write("pwmchip0/pwm1/polarity", polarity), 0);
  EXPECT_EQ(chip->Write("pwmchip0/pwm1/duty_cycle", duty), 0);
  EXPECT_EQ(chip->Write("pwmchip0/pwm1/enable", "1"), 0);
  return chip;
}

TEST_F(PwmLampTest, AChannelLeftInAnyStateIsTakenOver) {
  for (const bool active_low : {false, true}) {
    for (const char* polarity : {"normal", "inversed"}) {
      for (const char* period : {"50000", "100000", "900000"}) {
        SCOPED_TRACE(fmt::format("{} {} {}", active_low, polarity, period));
        chip = LeftChip(polarity, period, period);
        const auto lamp = Open(OnPwm(active_low));
        ASSERT_TRUE(lamp) << ToString(lamp.error());
        EXPECT_EQ(chip->Brightness(1), active_low ? 1 : 0);
        ASSERT_TRUE((*lamp)->SetLevel(0.25));
        EXPECT_EQ(chip->Brightness(1), active_low ? 0.75 : 0.25);
      }
    }
  }
}

TEST_F(PwmLampTest, ALampLeftDarkStaysSoWhileItIsTakenOver) {
  for (const bool active_low : {false, true}) {
    chip = LeftChip("normal", "100000", active_low ? "100000" : "0");
    const auto watched = std::make_shared<WatchedPwm>(chip, active_low);
    const auto lamp = OpenPwmLamp(OnPwm(active_low), watched, std::make_shared<SystemClock>());
    ASSERT_TRUE(lamp) << ToString(lamp.error());
    EXPECT_EQ(watched->brightest, 0);
    ASSERT_TRUE((*lamp)->SetLevel(1));
    EXPECT_EQ(watched->brightest, 1);
  }
}

TEST_F(PwmLampTest, RightsThatComeLateAreWaitedFor) {
  chip->DelayRights(3);
  EXPECT_TRUE(Open());
}

TEST_F(PwmLampTest, WhatIsNotThereOrTakenIsSaid) {
  LightConfig other = OnPwm(false);
  other.chip = "backlight";
  EXPECT_THAT(ToString(Open(other).error()), HasSubstr("1f00098000.pwm"));
  other = OnPwm(false);
  other.channel = 2;
  EXPECT_EQ(Open(other).error().kind, ErrorKind::bad_input);
  chip->Take(1);
  EXPECT_THAT(Open().error().mend, HasSubstr("another driver"));
}

TEST_F(PwmLampTest, EveryFailureOnTheWayIsAFaultOrOvercome) {
  ASSERT_TRUE(Open());
  const std::int64_t operations = chip->operations();
  ASSERT_GT(operations, 5);
  for (std::int64_t n = 1; n <= operations; ++n) {
    chip = std::make_shared<SimPwm>("1f00098000.pwm", 2);
    chip->FailAt(n);
    const auto lamp = Open();
    if (lamp) {
      EXPECT_FALSE((*lamp)->SetLevel(1)) << "all after it fail as well";
    } else {
      EXPECT_EQ(lamp.error().kind, ErrorKind::device) << n;
    }
  }
}

// The files themselves, without a kernel behind them.
TEST(KernelPwmFiles, ChipsAreFoundByTheirDeviceAndFilesWritten) {
  TempFolder folder;
  namespace fs = std::filesystem;
  for (const auto& [name, device] :
       {std::pair("pwmchip0", "backlight"), std::pair("pwmchip4", "1f00098000.pwm")}) {
    fs::create_directories(folder.path() / device);
    fs::create_directories(folder.path() / "class" / name / "pwm1");
    fs::create_directory_symlink(folder.path() / device, folder.path() / "class" / name / "device");
    ASSERT_TRUE(WriteFileDurably(folder.path() / "class" / name / "npwm", std::string_view("2\n")));
    for (const char* file : {"period", "duty_cycle", "enable"}) {
      ASSERT_TRUE(WriteFileDurably(folder.path() / "class" / name / "pwm1" / file,
                                   std::string_view("0\n")));
    }
  }
  const auto lamp = OpenPwmLamp(OnPwm(false), KernelPwmFiles(folder.path() / "class"),
                                std::make_shared<SystemClock>());
  ASSERT_TRUE(lamp) << ToString(lamp.error());
  ASSERT_TRUE((*lamp)->SetLevel(0.5));
  const fs::path output = folder.path() / "class" / "pwmchip4" / "pwm1";
  EXPECT_EQ(ReadTextFile(output / "duty_cycle").value().substr(0, 5), "50000");
  EXPECT_EQ(ReadTextFile(output / "period").value().substr(0, 6), "100000");
  EXPECT_EQ(ReadTextFile(output / "enable").value().substr(0, 1), "1");
}

}  // namespace
}  // namespace scan
