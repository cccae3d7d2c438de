#include "drivers/motion/tic/tic_protocol.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace scan {
namespace {

// The examples of Pololu's guide, 0J71 section 11.
TEST(TicProtocol, TransfersAreThoseOfTheGuide) {
  EXPECT_EQ(EncodeTic(TicCommand::set_target_position, 1'234'567'890),
            (UsbControl{0x40, 0xe0, 0x02d2, 0x4996}));
  EXPECT_EQ(EncodeTicSetting(0x41, 3), (UsbControl{0x40, 0x13, 0x0003, 0x0041}));
  EXPECT_EQ(EncodeTicRead(TicCommand::get_variable, 0x0a), (UsbControl{0xc0, 0xa1, 0, 0x000a}));
  EXPECT_EQ(EncodeTic(TicCommand::set_step_mode, *TicStepMode(8)),
            (UsbControl{0x40, 0x94, 0x0003, 0}));
  EXPECT_EQ(EncodeTic(TicCommand::energize), (UsbControl{0x40, 0x85, 0, 0}));
  EXPECT_EQ(EncodeTic(TicCommand::set_target_velocity, -2),
            (UsbControl{0x40, 0xe3, 0xfffe, 0xffff}));
  EXPECT_EQ(EncodeTic(TicCommand::go_home, 1), (UsbControl{0x40, 0x97, 1, 0}));
}

TEST(TicProtocol, AKnownBlockOfVariables) {
  TicVariablesBlock block{};
  const auto put = [&](std::size_t offset, std::initializer_list<int> bytes) {
    for (const int byte : bytes) block[offset++] = std::byte(byte);
  };
  put(0x00, {4, 0x1a});              // soft error; uncertain, reverse limit, homing
  put(0x02, {0xc4, 0x00});           // low VIN, command timeout, safe start
  put(0x04, {0x40, 0x00, 0x10, 0});  // command timeout, encoder skip
  put(0x0a, {0xd2, 0x02, 0x96, 0x49});
  put(0x0e, {0xff, 0xff, 0xff, 0xff});
  put(0x12, {1, 0, 0, 0});
  put(0x16, {0x80, 0x84, 0x1e, 0});  // 2000000
  put(0x1a, {2, 0, 0, 0});
  put(0x1e, {0x40, 0x9c, 0, 0});  // 40000
  put(0x22, {0x00, 0x00, 0x00, 0x80});
  put(0x26, {0xf0, 0xd8, 0xff, 0xff});  // -10000
  put(0x32, {4});
  put(0x33, {0xe0, 0x2e});  // 12000
  put(0x35, {0x10, 0x27, 0, 0});
  put(0x49, {5});
  TicVariables expected;
  expected.state = TicState::soft_error;
  expected.position_uncertain = expected.reverse_limit = expected.homing = true;
  expected.errors = 0xc4;
  expected.errors_occurred = 0x100040;
  expected.target_position = 1'234'567'890;
  expected.target_velocity = -1;
  expected.starting_speed = 1;
  expected.max_speed = 2'000'000;
  expected.max_decel = 2;
  expected.max_accel = 40'000;
  expected.position = INT32_MIN;
  expected.velocity = -10'000;
  expected.device_reset = 4;
  expected.vin_mv = 12'000;
  expected.up_time_ms = 10'000;
  expected.step_mode = 5;
  EXPECT_EQ(DecodeTicVariables(block), expected);
  EXPECT_EQ(EncodeTicVariables(expected), block);
}

TEST(TicProtocol, AKnownBlockOfSettings) {
  TicSettingsBlock block;
  block.fill(std::byte{0x55});
  TicSettings settings{1, 0x1234, 3, 0x10, 0x04, 0x01020304, 0x0a0b0c0d};
  EncodeTicSettings(settings, block);
  EXPECT_EQ(block[0x01], std::byte{1});
  EXPECT_EQ(block[0x09], std::byte{0x34});
  EXPECT_EQ(block[0x0a], std::byte{0x12});
  EXPECT_EQ(block[0x53], std::byte{3});
  EXPECT_EQ(block[0x5f], std::byte{0x10});
  EXPECT_EQ(block[0x60], std::byte{0x04});
  EXPECT_EQ(block[0x61], std::byte{0x04});
  EXPECT_EQ(block[0x68], std::byte{0x0a});
  EXPECT_EQ(std::count(block.begin(), block.end(), std::byte{0x55}), 0x69 - 14) << "the rest stays";
  EXPECT_EQ(DecodeTicSettings(block), settings);
}

TEST(TicProtocol, AnyBytesDecodeAndWhatIsKnownOfThemComesBack) {
  rc::check([](const std::vector<std::uint8_t>& bytes) {
    TicVariablesBlock block{};
    for (std::size_t k = 0; k < std::min(bytes.size(), block.size()); ++k) {
      block[k] = std::byte(bytes[k]);
    }
    const TicVariables variables = DecodeTicVariables(block);
    RC_ASSERT(DecodeTicVariables(EncodeTicVariables(variables)) == variables);
  });
}

TEST(TicProtocol, StepModesAreWhatTheyAreCalled) {
  for (int microsteps = 1; microsteps <= 256; microsteps *= 2) {
    const auto mode = TicStepMode(microsteps);
    ASSERT_TRUE(mode);
    EXPECT_EQ(TicMicrosteps(*mode), microsteps);
  }
  EXPECT_EQ(*TicStepMode(64), 7);
  EXPECT_EQ(TicMicrosteps(6), 0);
  for (const int microsteps : {0, -1, 3, 12, 512}) {
    EXPECT_FALSE(TicStepMode(microsteps)) << microsteps;
  }
}

TEST(TicProtocol, EveryErrorHasWordsAndAMend) {
  EXPECT_EQ(TicErrorWords(0), "");
  EXPECT_EQ(TicErrorWords(0x44), "low VIN, command timeout");
  EXPECT_EQ(TicErrorMend(0xc4), TicErrorMend(0x04)) << "of what weighs most";
  for (unsigned bit = 0; bit < 16; ++bit) {
    EXPECT_FALSE(TicErrorWords(static_cast<std::uint16_t>(1U << bit)).empty());
    EXPECT_FALSE(TicErrorMend(static_cast<std::uint16_t>(1U << bit)).empty());
  }
}

TEST(TicProtocol, BoardsAreKnownByTheirIds) {
  EXPECT_EQ(FindTicModel(0x1ffb, 0x00bd)->name, "Tic T500");
  EXPECT_EQ(FindTicModel(0x1ffb, 0x0089), nullptr);
  EXPECT_EQ(FindTicModel(0x1d6b, 0x00b3), nullptr);
}

}  // namespace
}  // namespace scan
