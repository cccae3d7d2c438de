// What the kernel's own listing makes of a tree like that of sysfs.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "drivers/camera/v4l2/kernel_v4l2.h"
#include "tests/support/temp_folder.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

void Write(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text << "\n";
}

// A node as sysfs shows it: class/video4linux/videoN -> devices/DEVICE/video4linux/videoN.
void AddNode(const fs::path& sys, const std::string& node, const std::string& device,
             const std::string& name) {
  const fs::path folder = sys / "devices" / device / "video4linux" / node;
  Write(folder / "name", name);
  fs::create_directory_symlink(sys / "devices" / device, folder / "device");
  fs::create_directories(sys / "class/video4linux");
  fs::create_directory_symlink(folder, sys / "class/video4linux" / node);
}

TEST(KernelNodes, APortIsTheSameWhateverTheNumbersOfNodeAndBus) {
  for (const std::string bus : {"1", "3"}) {
    TempFolder temp;
    const fs::path sys = temp.path();
    const std::string usb = "pci0000:00/0000:00:14.0/usb" + bus + "/" + bus + "-1/" + bus + "-1.4";
    AddNode(sys, "video" + bus, usb + "/" + bus + "-1.4:1.0", "HD Camera: HD Camera");
    Write(sys / "devices" / usb / "idVendor", "1bcf");
    Write(sys / "devices" / usb / "idProduct", "2b8a");
    Write(sys / "devices" / usb / "serial", "A1");
    const auto nodes = KernelV4l2(sys, "/dev").ListNodes();
    ASSERT_EQ(nodes.size(), 1U);
    EXPECT_EQ(nodes[0], (VideoNode{"/dev/video" + bus, "HD Camera: HD Camera", "0000:00:14.0/1.4",
                                   "1bcf:2b8a", "A1"}));
  }
}

TEST(KernelNodes, OtherDevicesAreNamedByWhatCarriesThem) {
  TempFolder temp;
  AddNode(temp.path(), "video10", "platform/vivid.0", "vivid-000-vid-cap");
  AddNode(temp.path(), "video9", "platform/vivid.1", "vivid-001-vid-cap");
  AddNode(temp.path(), "v4l-subdev0", "platform/sensor", "imx477");
  const auto nodes = KernelV4l2(temp.path(), "/dev").ListNodes();
  ASSERT_EQ(nodes.size(), 2U);
  EXPECT_EQ(nodes[0].path, "/dev/video9");
  EXPECT_EQ(nodes[1].port, "vivid.0");
  EXPECT_EQ(nodes[1].usb_id, "");
}

TEST(KernelNodes, AMachineWithoutCamerasHasNone) {
  TempFolder temp;
  EXPECT_TRUE(KernelV4l2(temp.path(), "/dev").ListNodes().empty());
}

TEST(KernelNodes, CallsGiveTheKernelsErrors) {
  KernelV4l2 kernel;
  EXPECT_EQ(kernel.Open("/nonexistent/video0"), -ENOENT);
  const int fd = kernel.Open("/dev/null");
  ASSERT_GE(fd, 0);
  EXPECT_EQ(kernel.Ioctl(fd, 0x80685600 /* VIDIOC_QUERYCAP */, nullptr), -ENOTTY);
  void* address = nullptr;
  EXPECT_LT(kernel.Map(fd, 4096, 0, address), 0);
  EXPECT_EQ(address, nullptr);
  kernel.Close(fd);
  EXPECT_EQ(kernel.Ioctl(fd, 0, nullptr), -EBADF);
}

}  // namespace
}  // namespace scan
