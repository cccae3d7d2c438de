#include "drivers/io/gpio/gpio_lines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "drivers/io/gpio/chip_files.h"
#include "tests/support/temp_folder.h"

namespace scan {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(GpioChips, AChipThatHasTwoNamesIsListedOnce) {
  TempFolder dev;
  for (const char* name : {"gpiochip10", "gpiochip0", "gpiomem"}) std::ofstream(dev.path() / name);
  std::filesystem::create_symlink("gpiochip0", dev.path() / "gpiochip4");
  EXPECT_THAT(GpioChipPaths(dev.path()), ElementsAre((dev.path() / "gpiochip0").string(),
                                                     (dev.path() / "gpiochip10").string()));
  EXPECT_THAT(GpioChipPaths(dev.path() / "none"), ElementsAre());
}

GpioRequest Asking(const std::string& chip, const std::vector<std::string>& names) {
  GpioRequest request{chip, "test", {}};
  for (const std::string& name : names) request.lines.push_back({.name = name});
  return request;
}

TEST(GpioLines, AreFoundByNameByNumberOrNotAtAllWithWords) {
  const std::vector<GpioChipInfo> chips{
      {"/dev/gpiochip0", "header", {{"A", "", false}, {"B", "", false}, {"B", "", false}}},
      {"/dev/gpiochip1", "expander", {{"A", "", false}, {"C", "", false}}}};
  const auto place = FindGpioLines(chips, Asking("", {"C", "A"}));
  ASSERT_TRUE(place) << ToString(place.error());
  EXPECT_EQ(place->chip, 1U);
  EXPECT_THAT(place->offsets, ElementsAre(1U, 0U));
  EXPECT_THAT(FindGpioLines(chips, Asking("header", {"2"}))->offsets, ElementsAre(2U));

  const struct {
    GpioRequest request;
    const char* what;
  } refused[] = {{Asking("", {"A", "D"}), "there is no chip with all of these lines (A, D;"},
                 {Asking("", {"A"}), "there is more than one chip with all of these lines (A)"},
                 {Asking("other", {"A"}), "there is no chip 'other' (A; chips here: header, exp"},
                 {Asking("header", {"B"}), "2 lines of the chip have this name"},
                 {Asking("header", {"3"}), "no such line"},
                 {Asking("header", {"A", "0"}), "asked for twice"}};
  for (const auto& one : refused) {
    const auto found = FindGpioLines(chips, one.request);
    ASSERT_FALSE(found) << one.what;
    EXPECT_EQ(found.error().kind, ErrorKind::device);
    EXPECT_THAT(found.error().what, HasSubstr(one.what));
    EXPECT_FALSE(found.error().mend.empty());
  }
}

}  // namespace
}  // namespace scan
