// The rules file read as strictly as udev does (udev(7)), and what it must not say.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "drivers/base/files.h"
#include "drivers/motion/tic/tic_protocol.h"
#include "tests/support/temp_folder.h"

namespace scan {
namespace {

using ::testing::HasSubstr;

struct Token {
  std::string key, op, value;
};
using Rule = std::vector<Token>;

const std::set<std::string> kMatchOnly{"ACTION",    "DEVPATH", "KERNEL",
                                       "SUBSYSTEM", "DRIVER",  "TEST"};
const std::set<std::string> kAssignOnly{"MODE", "GROUP", "OWNER"};

// One line's tokens; nothing where udev would refuse it.
std::optional<Rule> ParseRule(const std::string& line) {
  static const std::regex token(
      R"re(\s*([A-Z_]+(?:\{[^}]+\})?)\s*(==|!=|\+=|-=|:=|=)\s*"([^"]*)"\s*(,|$))re");
  Rule rule;
  auto at = line.cbegin();
  std::smatch match;
  while (at != line.cend()) {
    if (!std::regex_search(at, line.cend(), match, token, std::regex_constants::match_continuous)) {
      return std::nullopt;
    }
    const std::string name = match[1].str().substr(0, match[1].str().find('{'));
    const bool matches = match[2] == "==" || match[2] == "!=";
    if (kMatchOnly.contains(name) && !matches) return std::nullopt;
    if (kAssignOnly.contains(name) && matches) return std::nullopt;
    static const std::set<std::string> others{"ENV", "ATTR", "ATTRS", "SYMLINK", "TAG", "RUN"};
    if (!kMatchOnly.contains(name) && !kAssignOnly.contains(name) && !others.contains(name)) {
      return std::nullopt;
    }
    rule.push_back({match[1], match[2], match[3]});
    at = match[0].second;
    if (match[4] == "," && at == line.cend()) return std::nullopt;
  }
  return rule;
}

std::vector<Rule> Rules() {
  std::istringstream in(ReadTextFile(SCAN_SOURCE_DIR "/udev/60-scanstation.rules").value_or(""));
  std::vector<Rule> rules;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line.front() == '#') continue;
    const auto rule = ParseRule(line);
    EXPECT_TRUE(rule) << line;
    if (rule) rules.push_back(*rule);
  }
  return rules;
}

// What the rules make of a device: the values assigned when all their matches hold.
std::multimap<std::string, std::string> Apply(const std::map<std::string, std::string>& device) {
  const auto glob = [](std::string pattern) {
    pattern = std::regex_replace(pattern, std::regex(R"([.+^$()|\[\]{}])"), R"(\$&)");
    pattern = std::regex_replace(pattern, std::regex(R"(\*)"), ".*");
    return std::regex(std::regex_replace(pattern, std::regex(R"(\?)"), "."));
  };
  std::multimap<std::string, std::string> made;
  for (const Rule& rule : Rules()) {
    bool holds = true;
    for (const Token& token : rule) {
      if (token.op != "==") continue;
      const auto value = device.find(token.key);
      holds =
          holds && std::regex_match(value == device.end() ? "" : value->second, glob(token.value));
    }
    if (!holds) continue;
    for (const Token& token : rule) {
      if (token.op != "==") made.emplace(token.key, token.value);
    }
  }
  return made;
}

TEST(UdevRules, WhatUdevWouldRefuseIsSeen) {
  for (const char* line :
       {"MODE==\"0660\"", "KERNEL=\"video0\"", "MODE=\"0660\",", "mode=\"0660\"", "MODE=0660",
        "MODE=\"0660\" GROUP=\"video\"", "MODES=\"0660\"", "GROUP=\"video"}) {
    EXPECT_FALSE(ParseRule(line)) << line;
  }
  EXPECT_EQ(ParseRule("ATTR{index}==\"0\", SYMLINK+=\"x-%k\"")->size(), 2U);
}

TEST(UdevRules, NothingIsOpenToEverybody) {
  const auto rules = Rules();
  EXPECT_GE(rules.size(), 8U);
  for (const Rule& rule : rules) {
    std::map<std::string, std::string> made;
    bool matched = false;
    for (const Token& token : rule) {
      if (token.op == "==")
        matched = true;
      else
        made[token.key] = token.value;
    }
    EXPECT_TRUE(matched) << "a rule for every device of the machine";
    EXPECT_FALSE(made.contains("OWNER"));
    if (made.contains("MODE")) {
      EXPECT_EQ(made["MODE"], "0660");
      EXPECT_TRUE(made.contains("GROUP"));
    }
    if (made.contains("SYMLINK")) {
      EXPECT_EQ(made["SYMLINK"].find("scanstation/"), 0U);
    }
  }
}

TEST(UdevRules, EveryTicIsForPlugdevAndNamedByItsPort) {
  for (const TicModel& model : kTicModels) {
    char product[5];
    std::snprintf(product, sizeof product, "%04x", unsigned(model.product));
    const auto made = Apply({{"SUBSYSTEM", "usb"},
                             {"ENV{DEVTYPE}", "usb_device"},
                             {"ATTR{idVendor}", "1ffb"},
                             {"ATTR{idProduct}", product}});
    ASSERT_EQ(made.count("MODE"), 1U) << model.name;
    EXPECT_EQ(made.find("MODE")->second, "0660");
    EXPECT_EQ(made.find("GROUP")->second, "plugdev");
    EXPECT_EQ(made.find("SYMLINK")->second, "scanstation/tic-%k");
  }
}

TEST(UdevRules, CamerasAndLinesHaveTheirGroupsOtherDevicesAreLeftAlone) {
  const auto video = Apply({{"SUBSYSTEM", "video4linux"},
                            {"KERNEL", "video2"},
                            {"ATTR{index}", "0"},
                            {"ENV{ID_PATH_TAG}", "pci-0000_00_14_0-usb-0_4_1_0"}});
  EXPECT_EQ(video.find("GROUP")->second, "video");
  EXPECT_EQ(video.count("SYMLINK"), 1U);
  const auto metadata =
      Apply({{"SUBSYSTEM", "video4linux"}, {"KERNEL", "video3"}, {"ATTR{index}", "1"}});
  EXPECT_EQ(metadata.count("SYMLINK"), 0U) << "two nodes of one camera never share a name";
  const auto gpio = Apply({{"SUBSYSTEM", "gpio"}, {"KERNEL", "gpiochip0"}});
  EXPECT_EQ(gpio.find("GROUP")->second, "gpio");
  const auto dslr = Apply({{"SUBSYSTEM", "usb"},
                           {"ENV{DEVTYPE}", "usb_device"},
                           {"ENV{ID_USB_INTERFACES}", ":060101:"}});
  EXPECT_EQ(dslr.find("GROUP")->second, "plugdev");
  EXPECT_TRUE(Apply({{"SUBSYSTEM", "usb"},
                     {"ENV{DEVTYPE}", "usb_device"},
                     {"ATTR{idVendor}", "1ffb"},
                     {"ATTR{idProduct}", "0089"}})
                  .empty());
  const auto pwm = Apply({{"SUBSYSTEM", "pwm"}, {"KERNEL", "pwmchip0"}});
  ASSERT_EQ(pwm.count("RUN"), 1U);
  EXPECT_THAT(pwm.find("RUN")->second, HasSubstr("chgrp -R gpio /sys%p"));
  EXPECT_TRUE(Apply({{"SUBSYSTEM", "block"}, {"KERNEL", "sda"}}).empty());
}

// udev's own reading of the file, on a mocked board, in name spaces of its own: nothing of this
// machine is changed. SCAN_UDEVADM names an udevadm that is not installed.
TEST(UdevRules, UdevItselfGivesATicItsGroupAndName) {
  const char* named = std::getenv("SCAN_UDEVADM");
  const std::string udevadm = named ? named : "udevadm";
  const auto runs = [](const std::string& command) {
    return std::system((command + " >/dev/null 2>&1").c_str()) == 0;
  };
  if (!runs(udevadm + " --version") || !runs("umockdev-run --version")) {
    GTEST_SKIP() << "no udevadm or no umockdev-run here";
  }
  if (!runs("test -d /etc/udev/rules.d && unshare -rm true")) {
    GTEST_SKIP() << "no /etc/udev/rules.d, or no name spaces for this user";
  }
  const TempFolder folder;
  const std::string root = folder.path().string(),
                    device = "/devices/pci0000:00/0000:00:14.0/usb1/1-2";
  ASSERT_EQ(
      std::system(("mkdir " + root + "/dev " + root +
                   "/rules && cp " SCAN_SOURCE_DIR "/udev/60-scanstation.rules " + root + "/rules")
                      .c_str()),
      0);
  ASSERT_TRUE(
      WriteFileDurably(root + "/board", "P: " + device +
                                            "\nN: bus/usb/001/005\nE: BUSNUM=001\n"
                                            "E: DEVNUM=005\nE: DEVNAME=/dev/bus/usb/001/005\n"
                                            "E: DEVTYPE=usb_device\nE: PRODUCT=1ffb/b3/107\n"
                                            "E: SUBSYSTEM=usb\nE: MAJOR=189\nE: MINOR=4\n"
                                            "A: idVendor=1ffb\nA: idProduct=00b3\n"));
  const std::string inside = "mount --bind " + root +
                             "/rules /etc/udev/rules.d; mount -t tmpfs none /run; mount --bind " +
                             root + "/dev /dev; : >/dev/null; umockdev-run -d " + root +
                             "/board -- " + udevadm + " test /sys" + device;
  ASSERT_EQ(std::system(("unshare -rm sh -euc '" + inside + "' >" + root + "/out 2>&1").c_str()),
            0);
  const std::string out = ReadTextFile(root + "/out").value_or("");
  EXPECT_THAT(out, HasSubstr("MODE 0660"));
  EXPECT_THAT(out, HasSubstr("LINK 'scanstation/tic-1-2'"));
  for (const char* complaint : {"Invalid", "Unknown key", "unknown key", "missing", "error"}) {
    std::istringstream lines(out);
    for (std::string line; std::getline(lines, line);) {
      if (line.find("60-scanstation.rules") == std::string::npos) continue;
      EXPECT_EQ(line.find(complaint), std::string::npos) << line;
    }
  }
}

}  // namespace
}  // namespace scan
