#include "drivers/camera/ptp/ptp_device.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "drivers/camera/ptp/gpio_shutter.h"
#include "drivers/camera/ptp/ptp_picture.h"
#include "drivers/camera/ptp/usb_holders.h"
#include "drivers/io/gpio/sim_gpio_board.h"
#include "tests/support/ptp_bench.h"
#include "tests/support/temp_folder.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

const std::vector<PhotoDevice> kTwoEqual{
    {"Nikon DSC D850", "1-1", "7", "04b0:0441", "usb:001,002"},
    {"Nikon DSC D850", "1-2", "8", "04b0:0441", "usb:001,003"}};

TEST(PhotoDevices, EqualCamerasAreToldApartByPortOrSerial) {
  PtpConfig config;
  const auto both = FindPhotoDevice(kTwoEqual, config);
  ASSERT_FALSE(both);
  EXPECT_EQ(both.error().kind, ErrorKind::bad_input);
  config.port = "1-2";
  EXPECT_EQ(FindPhotoDevice(kTwoEqual, config)->serial, "8");
  config = {};
  config.serial = "7";
  EXPECT_EQ(FindPhotoDevice(kTwoEqual, config)->port, "1-1");
  config.model = "Canon EOS 5D";
  const auto none = FindPhotoDevice(kTwoEqual, config);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().kind, ErrorKind::device);
  EXPECT_NE(none.error().what.find("Nikon DSC D850 at port 1-1"), std::string::npos);
}

TEST(PhotoDevices, TheProgramThatHoldsTheCameraIsNamed) {
  PtpBench bench;
  bench.dslr->open_fault = PhotoFaultKind::claimed;
  bench.dslr->competitors = {"gvfsd-gphoto2 (812)"};
  const Status desktop = bench.Open();
  ASSERT_FALSE(desktop);
  EXPECT_NE(desktop.error().what.find("held by gvfsd-gphoto2 (812)"), std::string::npos);
  EXPECT_NE(desktop.error().mend.find("systemctl --user mask"), std::string::npos);
  bench.dslr->competitors = {"darktable (99)"};
  EXPECT_EQ(bench.Open().error().mend, "end that program");
}

// A process as /proc shows it.
void AddProcess(const fs::path& proc, int pid, const std::string& name, const fs::path& open) {
  const fs::path folder = proc / std::to_string(pid);
  fs::create_directories(folder / "fd");
  std::ofstream(folder / "comm") << name << "\n";
  fs::create_symlink("/dev/null", folder / "fd" / "0");
  if (!open.empty()) fs::create_symlink(open, folder / "fd" / "7");
}

TEST(UsbHolders, ProgramsThatHoldTheNodeAndTheDesktopsServices) {
  const TempFolder proc;
  const fs::path node = "/dev/bus/usb/001/005";
  AddProcess(proc.path(), 40, "bash", {});
  AddProcess(proc.path(), 812, "gvfs-gphoto2-vo", {});
  AddProcess(proc.path(), 99, "darktable", node);
  AddProcess(proc.path(), 100, "other", "/dev/bus/usb/001/006");
  fs::create_directories(proc.path() / "self");
  EXPECT_EQ(ProgramsTakingCamera(node, proc.path()),
            (std::vector<std::string>{"darktable (99)", "gvfs-gphoto2-vo (812)"}));
  EXPECT_TRUE(IsDesktopService("gvfs-gphoto2-vo (812)"));
  EXPECT_FALSE(IsDesktopService("darktable (99)"));
  EXPECT_TRUE(ProgramsTakingCamera(node, proc.path() / "absent").empty());
}

TEST(Readiness, BatteryAndCardAreCheckedBeforeARun) {
  PtpBench bench;
  bench.dslr->setting("batterylevel").value = "15%";
  const Status flat = bench.Open();
  ASSERT_FALSE(flat);
  EXPECT_NE(flat.error().what.find("15 % left"), std::string::npos);
  bench.dslr->setting("batterylevel").value = "20%";
  bench.dslr->cards = {{"CARD", true, 30'000, 3}};
  EXPECT_TRUE(bench.Open());  // into memory: the card does not matter
  bench.wish.config.target = "card";
  const Status full = bench.Open();
  ASSERT_FALSE(full);
  EXPECT_NE(full.error().what.find("room for 3 pictures"), std::string::npos);
  bench.dslr->cards = {{"READ ONLY", false, 30'000'000, 900}, {"CARD", true, 30'000'000, 900}};
  EXPECT_TRUE(bench.Open());
  bench.dslr->cards.clear();
  bench.dslr->RemoveSetting("availableshots");
  EXPECT_FALSE(bench.Open());  // no card at all
}

TEST(Readiness, CapabilitiesAreCheckedBeforeUse) {
  PtpBench bench;
  bench.dslr->abilities.capture = bench.dslr->abilities.trigger = false;
  const Status opened = bench.Open();
  ASSERT_FALSE(opened);
  EXPECT_NE(opened.error().what.find("cannot be released over USB"), std::string::npos);
  EXPECT_EQ(bench.dslr->open_cameras, 0);
}

TEST(Pictures, OfOneExposure) {
  EXPECT_TRUE(CheckOneExposure({{"/", "DSC_0001.NEF"}, {"/", "DSC_0001.JPG"}}, ""));
  EXPECT_TRUE(CheckOneExposure({{"/", "capt0000.nef"}, {"/", "capt0001.jpg"}}, ""));
  EXPECT_FALSE(CheckOneExposure({{"/", "DSC_0001.NEF"}, {"/", "DSC_0002.JPG"}}, ""));
  EXPECT_FALSE(CheckOneExposure({{"/", "capt0000.jpg"}, {"/", "capt0001.jpg"}}, ""));
  EXPECT_FALSE(CheckOneExposure({{"/", "MVI_0001.MOV"}}, ""));
  EXPECT_FALSE(CheckOneExposure({{"/", "noname"}}, ""));
}

TEST(Pictures, AJpegIsWholeAndOfItsSize) {
  const EncodedFile whole{"jpg", SimDslrJpeg(1)};
  EXPECT_TRUE(CheckPicture(whole, 64, 48, ""));
  EXPECT_TRUE(CheckPicture(whole, 0, 0, ""));
  EXPECT_FALSE(CheckPicture(whole, 48, 64, ""));
  EncodedFile padded = whole;
  padded.bytes.resize(whole.bytes.size() + 4096);
  EXPECT_TRUE(CheckPicture(padded, 64, 48, ""));
  for (std::size_t size = 0; size < whole.bytes.size(); ++size) {  // cut anywhere
    const EncodedFile cut{"jpg",
                          {whole.bytes.begin(), whole.bytes.begin() + static_cast<long>(size)}};
    EXPECT_FALSE(CheckPicture(cut, 64, 48, "")) << size;
  }
  EXPECT_FALSE(CheckPicture({"nef", whole.bytes}, 64, 48, ""));
}

TEST(Pictures, TheEndOfAThumbnailIsNotThePictures) {
  std::vector<std::byte> picture = SimDslrJpeg(1);
  const std::vector<std::byte> thumbnail = SimDslrJpeg(2);
  std::vector<std::byte> segment{std::byte{0xff}, std::byte{0xe1},
                                 static_cast<std::byte>((thumbnail.size() + 2) >> 8),
                                 static_cast<std::byte>((thumbnail.size() + 2) & 0xff)};
  segment.insert(segment.end(), thumbnail.begin(), thumbnail.end());
  picture.insert(picture.begin() + 2, segment.begin(), segment.end());
  EXPECT_TRUE(CheckPicture({"jpg", picture}, 64, 48, ""));
  for (std::size_t size = 0; size < picture.size(); ++size) {
    const EncodedFile cut{"jpg", {picture.begin(), picture.begin() + static_cast<long>(size)}};
    EXPECT_FALSE(CheckPicture(cut, 64, 48, "")) << size;
  }
}

TEST(GpioShutter, PressesAndHears) {
  auto clock = std::make_shared<VirtualClock>();
  auto board =
      std::make_shared<SimGpioBoard>("chip", std::vector<std::string>{"RELEASE", "SYNC"}, clock);
  PtpConfig config;
  EXPECT_EQ(OpenGpioShutter(config, board->Opener()).value(), nullptr);
  config.release_line = "RELEASE";
  config.hot_shoe_line = "SYNC";
  board->Drive("SYNC", true);
  {
    auto shutter = OpenGpioShutter(config, board->Opener());
    ASSERT_TRUE(shutter) << ToString(shutter.error());
    ASSERT_TRUE((*shutter)->Press(true));
    EXPECT_TRUE(board->Level("RELEASE"));
    ASSERT_TRUE((*shutter)->Press(false));
    EXPECT_FALSE(board->Level("RELEASE"));
    clock->SleepFor(1000);
    const std::int64_t closed_ns = clock->Now().mono_ns;
    board->Drive("SYNC", false);
    clock->SleepFor(1000);
    board->Drive("SYNC", true);
    EXPECT_EQ((*shutter)->TakeHotShoe().value(), std::vector<std::int64_t>{closed_ns});
    EXPECT_TRUE((*shutter)->TakeHotShoe()->empty());
    ASSERT_TRUE((*shutter)->Press(true));
  }
  EXPECT_FALSE(board->Level("RELEASE"));  // never left pressed
  config.hot_shoe_line = "ABSENT";
  EXPECT_FALSE(OpenGpioShutter(config, board->Opener()));
}

}  // namespace
}  // namespace scan
