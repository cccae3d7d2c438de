#include "drivers/usb/usb_bus.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "drivers/usb/libusb_bus.h"
#include "drivers/usb/sim_usb_bus.h"

namespace scan {
namespace {

using ::testing::HasSubstr;

class Echo final : public SimUsbFunction {
 public:
  bool Write(const UsbControl& control, std::span<const std::byte>) override {
    last = control;
    return control.request != 0xff;
  }
  bool Read(const UsbControl& control, std::span<std::byte> data) override {
    last = control;
    for (std::byte& byte : data) byte = std::byte{control.request};
    return true;
  }
  UsbControl last;
};

UsbIdentity At(const std::string& port, const std::string& serial) {
  return {0x1ffb, 0x00b3, 0x0107, port, serial, "thing", 0, 0};
}

TEST(FindUsb, NamesTheOneThatFits) {
  const std::vector<UsbIdentity> devices{
      At("1-1", "A"), At("1-2.3", "B"), At("1-2.4", "B"), {0x1d6b, 2, 0, "usb1", "", "hub", 1, 1}};
  const UsbSelector any{0x1ffb, {0x00b3}, "", ""};
  EXPECT_EQ(FindUsb(devices, {0x1ffb, {0x00b3}, "", "A"}, "thing")->port, "1-1");
  EXPECT_EQ(FindUsb(devices, {0x1ffb, {}, "1-2.4", ""}, "thing")->port, "1-2.4");
  const auto several = FindUsb(devices, {0x1ffb, {0x00b3}, "", "B"}, "thing");
  ASSERT_FALSE(several);
  EXPECT_EQ(several.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(several.error().where, HasSubstr("1-2.3, 1-2.4"));
  const auto none = FindUsb(devices, {0x1ffb, {0x00b3}, "1-9", ""}, "thing");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().kind, ErrorKind::device);
  EXPECT_THAT(none.error().what, HasSubstr("at port 1-9"));
  EXPECT_THAT(none.error().mend, HasSubstr("serial A")) << "says what is there";
  EXPECT_FALSE(FindUsb({}, any, "thing"));
}

TEST(SimUsbBus, TwoEqualDevicesAreToldApartByTheirPorts) {
  const auto bus = std::make_shared<SimUsbBus>();
  const auto left = std::make_shared<Echo>(), right = std::make_shared<Echo>();
  bus->Plug(At("1-1", "S"), left);
  bus->Plug(At("1-2", "S"), right);
  const auto a = bus->Open(At("1-1", "S"));
  const auto b = bus->Open(At("1-2", "S"));
  ASSERT_TRUE(a && b);
  ASSERT_TRUE((*a)->Write({0x40, 1, 10, 0}, {}));
  ASSERT_TRUE((*b)->Write({0x40, 1, 20, 0}, {}));
  EXPECT_EQ(left->last.value, 10);
  EXPECT_EQ(right->last.value, 20);
  EXPECT_FALSE(bus->Open(At("1-1", "S"))) << "held";

  bus->Unplug("1-1");
  EXPECT_FALSE((*a)->Write({0x40, 1, 11, 0}, {}));
  bus->Plug(At("1-1", "S"), left);
  EXPECT_FALSE((*a)->Write({0x40, 1, 12, 0}, {})) << "the old handle stays dead";
  EXPECT_FALSE(bus->Open(At("1-1", "other"))) << "another device at that port";
  const auto again = bus->Open(At("1-1", "S"));
  ASSERT_TRUE(again);
  EXPECT_TRUE((*again)->Write({0x40, 1, 13, 0}, {}));
  EXPECT_EQ(left->last.value, 13);
  EXPECT_EQ(right->last.value, 20);
}

TEST(SimUsbBus, AStallAndTheNthTransferAreFaults) {
  const auto bus = std::make_shared<SimUsbBus>();
  bus->Plug(At("1-1", "S"), std::make_shared<Echo>());
  const auto device = bus->Open(At("1-1", "S"));
  ASSERT_TRUE(device);
  EXPECT_FALSE((*device)->Write({0x40, 0xff, 0, 0}, {}));
  std::byte data[3];
  bus->FailAt(2);
  EXPECT_TRUE((*device)->Read({0xc0, 7, 0, 0}, data));
  EXPECT_EQ(data[2], std::byte{7});
  const auto failed = (*device)->Read({0xc0, 7, 0, 0}, data);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().kind, ErrorKind::device);
  EXPECT_TRUE((*device)->Read({0xc0, 7, 0, 0}, data));
  bus->FailAt(1, true);
  EXPECT_FALSE((*device)->Read({0xc0, 7, 0, 0}, data));
  EXPECT_FALSE((*device)->Read({0xc0, 7, 0, 0}, data)) << "unplugged";
  EXPECT_TRUE(bus->List()->empty());
}

TEST(SimUsbBus, AWatchTellsOfWhatIsThereComesAndGoes) {
  const auto bus = std::make_shared<SimUsbBus>();
  bus->Plug(At("1-1", "A"), std::make_shared<Echo>());
  std::vector<std::string> told;
  auto watch = bus->Watch([&](const UsbEvent& event) {
    told.push_back((event.arrived ? "+" : "-") + event.identity.port);
  });
  ASSERT_TRUE(watch);
  bus->Plug(At("1-2", "B"), std::make_shared<Echo>());
  bus->Unplug("1-1");
  bus->Plug(At("1-2", "C"), std::make_shared<Echo>());  // replaces
  EXPECT_THAT(told, ::testing::ElementsAre("+1-1", "+1-2", "-1-1", "-1-2", "+1-2"));
  watch->reset();
  bus->Unplug("1-2");
  EXPECT_EQ(told.size(), 5U);
}

// Whatever this machine has on its bus, perhaps nothing.
TEST(LibusbBus, ListsEveryDeviceOnceAndWatchTellsOfTheSame) {
  const auto bus = MakeLibusbBus();
  if (!bus) GTEST_SKIP() << "no USB here: " << ToString(bus.error());
  const auto list = (*bus)->List();
  if (!list) GTEST_SKIP() << "no USB here: " << ToString(list.error());
  std::set<std::string> ports;
  for (const UsbIdentity& identity : *list) {
    EXPECT_TRUE(ports.insert(identity.port).second) << Describe(identity);
  }
  const auto missing = (*bus)->Open({0x1ffb, 0x00b3, 0, "99-1", "none", "", 0, 0});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, ErrorKind::device);
  EXPECT_THAT(missing.error().mend, HasSubstr("unplugged"));
  std::set<std::string> told;
  {
    const auto watch = (*bus)->Watch([&](const UsbEvent& event) {
      if (event.arrived) told.insert(event.identity.port);
    });
    if (!watch) GTEST_SKIP() << "no udev here: " << ToString(watch.error());
  }
  EXPECT_EQ(told, ports);
}

}  // namespace
}  // namespace scan
