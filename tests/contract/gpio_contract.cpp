#include "tests/contract/gpio_contract.h"

#include <gmock/gmock.h>
#include <sys/eventfd.h>

#include <thread>

#include "drivers/base/unique_fd.h"

namespace scan {
namespace {

using ::testing::HasSubstr;

constexpr std::int64_t kSecondNs = 1'000'000'000;

GpioLineConfig Out(const std::string& name, bool initial = false, bool active_low = false) {
  return {name, true, active_low, initial, GpioBias::as_is, false};
}
GpioLineConfig In(const std::string& name, bool edges = false, bool active_low = false) {
  return {name, false, active_low, false, GpioBias::as_is, edges};
}

TEST_P(GpioContract, OutputsHaveTheirLevelFromTheRequestOn) {
  const auto lines = MustOpen({Out(twin.out_a, true), Out(twin.out_b, true, true)});
  ASSERT_TRUE(lines);
  EXPECT_EQ(lines->size(), 2U);
  EXPECT_TRUE(twin.level(twin.out_a));
  EXPECT_FALSE(twin.level(twin.out_b)) << "active is low";
}

TEST_P(GpioContract, SetChangesTheLinesGivenAndKeepsTheOthers) {
  const auto lines = MustOpen({Out(twin.out_a), Out(twin.out_b, false, true)});
  ASSERT_TRUE(lines);
  const GpioLevel both[] = {{0, true}, {1, true}};
  ASSERT_TRUE(lines->Set(both));
  EXPECT_TRUE(twin.level(twin.out_a));
  EXPECT_FALSE(twin.level(twin.out_b));
  const GpioLevel second[] = {{1, false}};
  ASSERT_TRUE(lines->Set(second));
  EXPECT_TRUE(twin.level(twin.out_a));
  EXPECT_TRUE(twin.level(twin.out_b));
  const auto read = lines->Get(1);
  ASSERT_TRUE(read);
  EXPECT_FALSE(*read);
}

TEST_P(GpioContract, InputsReadWhatIsDrivenFromOutside) {
  const auto lines = MustOpen({In(twin.in_a), In(twin.in_b, false, true)});
  ASSERT_TRUE(lines);
  for (const bool high : {true, false, true}) {
    twin.drive(twin.in_a, high);
    twin.drive(twin.in_b, high);
    EXPECT_EQ(lines->Get(0).value(), high);
    EXPECT_EQ(lines->Get(1).value(), !high) << "active is low";
  }
}

TEST_P(GpioContract, EdgesComeOnceInOrderWithRisingTimes) {
  twin.drive(twin.in_a, false);
  twin.drive(twin.in_b, false);
  const auto lines = MustOpen({In(twin.in_a, true), In(twin.in_b, true, true)});
  ASSERT_TRUE(lines);
  const std::int64_t before_ns = twin.now_ns();
  for (const bool high : {true, false, true}) {
    twin.drive(twin.in_a, high);
    const auto edge = lines->WaitEdge(10 * kSecondNs);
    ASSERT_TRUE(edge && *edge);
    EXPECT_EQ((*edge)->line, 0U);
    EXPECT_EQ((*edge)->active, high);
    EXPECT_GE((*edge)->mono_ns, before_ns);
    EXPECT_LE((*edge)->mono_ns, twin.now_ns());
  }
  twin.drive(twin.in_b, true);
  const auto edge = lines->WaitEdge(10 * kSecondNs);
  ASSERT_TRUE(edge && *edge);
  EXPECT_EQ((*edge)->line, 1U);
  EXPECT_FALSE((*edge)->active) << "active is low";
  EXPECT_EQ(lines->WaitEdge(0).value(), std::nullopt);
}

// Quick edges of one line may come as one: the kernel reads the level when its thread gets to it.
TEST_P(GpioContract, EdgesBeforeTheCallAreKept) {
  twin.drive(twin.in_a, false);
  twin.drive(twin.in_b, true);
  const auto lines = MustOpen({In(twin.in_a, true), In(twin.in_b, true)});
  ASSERT_TRUE(lines);
  twin.drive(twin.in_a, true);
  twin.drive(twin.in_b, false);
  for (std::size_t line = 0; line < 2; ++line) {
    const auto edge = lines->WaitEdge(10 * kSecondNs);
    ASSERT_TRUE(edge && *edge);
    EXPECT_EQ((*edge)->active, (*edge)->line == 0);
  }
}

TEST_P(GpioContract, AWaitEndsWithItsTimeOrItsDescriptor) {
  twin.drive(twin.in_a, false);
  const auto lines = MustOpen({In(twin.in_a, true)});
  ASSERT_TRUE(lines);
  EXPECT_EQ(lines->WaitEdge(1'000'000).value(), std::nullopt);
  const UniqueFd wake(eventfd(0, EFD_CLOEXEC));
  std::thread waker([&] { eventfd_write(wake.get(), 1); });
  EXPECT_EQ(lines->WaitEdge(-1, wake.get()).value(), std::nullopt);
  waker.join();
}

TEST_P(GpioContract, ALineIsNamedByItsNumberToo) {
  const auto lines = MustOpen({Out(std::to_string(twin.out_a_number), true)});
  ASSERT_TRUE(lines);
  EXPECT_TRUE(twin.level(twin.out_a));
}

TEST_P(GpioContract, AChipIsFoundByTheNamesOfItsLines) {
  const auto opened = twin.open({"", "contract", {Out(twin.out_a, true)}});
  ASSERT_TRUE(opened) << ToString(opened.error());
  EXPECT_TRUE(twin.level(twin.out_a));
}

TEST_P(GpioContract, WhatIsNotThereOrTakenIsSaid) {
  const auto refused = [&](const std::string& chip, std::vector<GpioLineConfig> lines) {
    const auto opened = twin.open({chip, "contract", std::move(lines)});
    EXPECT_FALSE(opened);
    if (opened) return std::string();
    EXPECT_EQ(opened.error().kind, ErrorKind::device);
    EXPECT_FALSE(opened.error().mend.empty());
    return ToString(opened.error());
  };
  EXPECT_THAT(refused("no-such-chip", {Out(twin.out_a)}), HasSubstr(twin.chip)) << "what is there";
  EXPECT_THAT(refused(twin.chip, {Out("NO_SUCH_LINE")}), HasSubstr("NO_SUCH_LINE"));
  EXPECT_THAT(refused("", {Out("NO_SUCH_LINE")}), HasSubstr("NO_SUCH_LINE"));
  EXPECT_THAT(refused(twin.chip, {Out("4000000000")}), HasSubstr("no such line"));
  EXPECT_THAT(refused(twin.chip, {Out(twin.out_a), Out(twin.out_a)}), HasSubstr("twice"));
  const auto holder = MustOpen({Out(twin.out_a)});
  EXPECT_THAT(refused(twin.chip, {Out(twin.out_b), Out(twin.out_a)}), HasSubstr("contract"))
      << "who holds it";
}

TEST_P(GpioContract, ALineThatWasGivenBackCanBeTakenAgain) {
  for (int k = 0; k < 50; ++k) {
    const auto lines = MustOpen({Out(twin.out_a, k % 2 == 0), Out(twin.out_b)});
    ASSERT_TRUE(lines);
    EXPECT_EQ(twin.level(twin.out_a), k % 2 == 0);
  }
}

}  // namespace
}  // namespace scan
