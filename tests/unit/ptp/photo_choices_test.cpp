#include "drivers/camera/ptp/photo_choices.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>

namespace scan {
namespace {

TEST(PhotoChoices, ExposureTimesOfEveryMaker) {
  const std::vector<std::pair<const char*, double>> known{
      {"1/125", 8000},  {"30", 30e6},      {"0.4", 0.4e6},     {"0.0080s", 8000},
      {"13/10", 1.3e6}, {"1/2.5s", 0.4e6}, {"1/1.6", 0.625e6}, {"1 1/3", 4e6 / 3},
      {"0\"4", 0.4e6},  {"2\"", 2e6},      {"1\"3", 1.3e6},    {" 1/8000 ", 125}};
  for (const auto& [text, us] : known) {
    ASSERT_TRUE(ExposureUsOf(text)) << text;
    EXPECT_NEAR(*ExposureUsOf(text), us, 1e-9 * us) << text;
  }
  for (const char* text : {"Bulb", "Time", "x 200", "", "1/", "/125", "1/0", "0", "-1", "1/-8",
                           "1/125 extra", "nan", "inf", "1e3", "s", "\"", "1//2", "Unknown 1/125"})
    EXPECT_FALSE(ExposureUsOf(text)) << text;
}

TEST(PhotoChoices, AnyFractionIsReadAsItIsWritten) {
  EXPECT_TRUE(rc::check("fractions", [] {
    const int over = *rc::gen::inRange(1, 4000), under = *rc::gen::inRange(1, 32'000);
    const double us = 1e6 * over / under;
    for (const std::string& text :
         {fmt::format("{}/{}", over, under), fmt::format("{}/{}s", over, under),
          fmt::format(" {}/{} ", over, under)}) {
      const auto read = ExposureUsOf(text);
      RC_ASSERT(read && std::abs(*read - us) <= 1e-9 * us);
    }
    const auto seconds = ExposureUsOf(fmt::format("{}.{}s", over, under));
    RC_ASSERT(seconds && *seconds >= 1e6 * over && *seconds < 1e6 * (over + 1));
  }));
}

TEST(PhotoChoices, AnyTextGivesAPositiveTimeOrNone) {
  EXPECT_TRUE(rc::check("texts", [] {
    const auto text = *rc::gen::container<std::string>(
        rc::gen::element('0', '1', '9', '/', '.', '"', ' ', 's', '-', '+', 'e', 'B', '\xff', '\0'));
    for (const auto number : {ExposureUsOf(text), IsoOf(text), FNumberOf(text)})
      RC_ASSERT(!number || (*number > 0 && std::isfinite(*number)));
    const auto percent = BatteryPercentOf(text);
    RC_ASSERT(!percent || *percent >= 0);
  }));
}

TEST(PhotoChoices, SpeedsAperturesBatteries) {
  EXPECT_EQ(IsoOf("100"), 100);
  EXPECT_EQ(IsoOf("ISO 1600"), 1600);
  EXPECT_FALSE(IsoOf("Auto"));
  EXPECT_FALSE(IsoOf("Hi 1"));
  EXPECT_EQ(FNumberOf("f/5.6"), 5.6);
  EXPECT_EQ(FNumberOf("F8"), 8);
  EXPECT_EQ(FNumberOf("11"), 11);
  EXPECT_FALSE(FNumberOf("implicit auto"));
  EXPECT_EQ(BatteryPercentOf("75%"), 75);
  EXPECT_EQ(BatteryPercentOf("0%"), 0);
  EXPECT_EQ(BatteryPercentOf("Low"), 5);
  EXPECT_FALSE(BatteryPercentOf("Unknown value 0009"));
}

TEST(PhotoChoices, TheNearestChoiceOrItsNeighbours) {
  const std::vector<std::string> speeds{"Bulb", "1/60", "1/125", "1/100", "30"};
  EXPECT_EQ(NearestChoice(speeds, ExposureUsOf, 16'667, 0.01, "exposure", "us").value(), "1/60");
  EXPECT_EQ(NearestChoice(speeds, ExposureUsOf, 30e6, 0.01, "exposure", "us").value(), "30");
  const auto between = NearestChoice(speeds, ExposureUsOf, 9000, 0.01, "exposure", "us");
  ASSERT_FALSE(between);
  EXPECT_EQ(between.error().kind, ErrorKind::bad_input);
  EXPECT_NE(between.error().mend.find("8000 us (1/125) or 10000 us (1/100)"), std::string::npos)
      << between.error().mend;
  for (const double us : {0.0, -1.0, std::nan(""), double{INFINITY}})
    EXPECT_FALSE(NearestChoice(speeds, ExposureUsOf, us, 0.01, "exposure", "us")) << us;
  EXPECT_FALSE(NearestChoice({"Auto"}, IsoOf, 100, 0.01, "speed", "ISO"));
}

}  // namespace
}  // namespace scan
