// The V4L2 camera on the kernel's own drivers. The environment names the camera: LAB_CAMERA its
// port, LAB_FORMATS the formats to try, LAB_SIZE (WxH) their size.
#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <opencv2/core.hpp>
#include <sstream>
#include <thread>

#include "drivers/camera/decode_picture.h"
#include "drivers/camera/v4l2/convert.h"
#include "drivers/camera/v4l2/kernel_v4l2.h"
#include "drivers/camera/v4l2/v4l2_camera.h"
#include "tests/contract/twin.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

std::string Environment(const char* name, const char* otherwise) {
  const char* value = std::getenv(name);
  return value ? value : otherwise;
}

std::vector<std::string> Formats() {
  std::istringstream words(Environment("LAB_FORMATS", "YUYV"));
  std::vector<std::string> formats;
  for (std::string word; words >> word;) formats.push_back(word);
  return formats;
}

V4l2CameraOptions OptionsFor(const std::string& format) {
  V4l2CameraOptions options;
  options.config.port = Environment("LAB_CAMERA", "");
  options.config.pixel_format = format;
  options.config.timeout_ms = 20'000;  // the guest's processor is emulated
  options.config.reconnect_ms = 60'000;
  options.config.frame_interval_ms = std::stod(Environment("LAB_INTERVAL_MS", "0"));
  std::istringstream size(Environment("LAB_SIZE", "640x480"));
  char x = 0;
  size >> options.w >> x >> options.h;
  return options;
}

struct Rig {
  std::shared_ptr<KernelV4l2> system = std::make_shared<KernelV4l2>();
  std::shared_ptr<SystemClock> clock = std::make_shared<SystemClock>();
  Result<std::unique_ptr<V4l2Camera>> Open(const V4l2CameraOptions& options) {
    return V4l2Camera::Open(options, system, clock);
  }
};

TwinFactory<Camera> Factory(const std::string& format) {
  return {format, [format] {
            Rig rig;
            auto camera = rig.Open(OptionsFor(format));
            EXPECT_TRUE(camera) << ToString(camera.error());
            Twin<Camera> twin;
            twin.clock = rig.clock;
            if (camera) twin.device = std::move(*camera);
            return twin;
          }};
}

std::vector<TwinFactory<Camera>> Factories() {
  std::vector<TwinFactory<Camera>> factories;
  for (const std::string& format : Formats()) factories.push_back(Factory(format));
  return factories;
}

INSTANTIATE_TEST_SUITE_P(Kernel, CameraContract, ::testing::ValuesIn(Factories()),
                         [](const auto& instance) { return instance.param.name; });

class KernelCamera : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    auto opened = rig.Open(OptionsFor(GetParam()));
    ASSERT_TRUE(opened) << ToString(opened.error());
    camera = std::move(*opened);
  }
  Rig rig;
  std::unique_ptr<V4l2Camera> camera;
};

INSTANTIATE_TEST_SUITE_P(Formats, KernelCamera, ::testing::ValuesIn(Formats()),
                         [](const auto& instance) { return instance.param; });

struct Reading {
  std::vector<std::uint32_t> sequences;
  int lost = 0;
  int repeated = 0;  // numbers that follow the driver's clock (vivid's do) may come twice
  double frames_per_s = 0;
};

Result<Reading> ReadFrames(V4l2Stream& stream, Clock& clock, int count) {
  Reading reading;
  std::int64_t first_ns = 0;
  constexpr int kOld = 8;  // of the time in which nobody read
  for (int i = 0; i < count + kOld; ++i) {
    SCAN_TRY(const auto frame, stream.Next(clock, clock.Now().mono_ns + 20'000'000'000, {}));
    EXPECT_EQ(frame.bytes().data(), stream.Memory(frame.buffer).data());
    if (i < kOld) continue;
    EXPECT_FALSE(frame.flagged);
    if (!reading.sequences.empty()) {
      const auto lost = static_cast<int>(frame.sequence - reading.sequences.back() - 1);
      reading.lost += std::max(lost, 0);
      reading.repeated += lost < 0;
    } else {
      first_ns = frame.stamp_ns;
    }
    reading.sequences.push_back(frame.sequence);
    reading.frames_per_s = (count - 1) * 1e9 / static_cast<double>(frame.stamp_ns - first_ns);
  }
  return reading;
}

TEST_P(KernelCamera, AContinuousReaderLosesNoFrameAndCopiesNone) {
  constexpr int kFrames = 100;
  V4l2Stream& stream = *camera->stream();
  // A machine that stalls the whole guest makes the driver itself skip: then once more. A reader
  // that loses frames loses them in every round.
  Result<Reading> reading = ReadFrames(stream, *rig.clock, kFrames);
  for (int round = 0; round < 5 && reading && reading->lost + reading->repeated > 0; ++round) {
    reading = ReadFrames(stream, *rig.clock, kFrames);
  }
  ASSERT_TRUE(reading) << ToString(reading.error());
  EXPECT_EQ(reading->lost, 0);
  EXPECT_EQ(reading->repeated, 0);
  const StreamFormat& format = stream.format();
  fmt::print(
      "figure: {} {} {}x{}: {} frames in sequence, none lost, {:.1f} frames/s (own rate {:.1f}), "
      "0 copies before decoding\n",
      camera->Info().model, format.format->name, format.w, format.h, kFrames, reading->frames_per_s,
      format.interval_ns > 0 ? 1e9 / static_cast<double>(format.interval_ns) : 0.0);
}

TEST_P(KernelCamera, AnExportedBufferHoldsTheSameBytes) {
  V4l2Stream& stream = *camera->stream();
  const auto frame = stream.Next(*rig.clock, rig.clock->Now().mono_ns + 20'000'000'000, {});
  ASSERT_TRUE(frame) << ToString(frame.error());
  const auto exported = stream.ExportDmaBuffer(frame->buffer);
  ASSERT_TRUE(exported) << ToString(exported.error());
  const std::size_t size = stream.Memory(frame->buffer).size();
  void* memory = mmap(nullptr, size, PROT_READ, MAP_SHARED, exported->fd(), 0);
  ASSERT_NE(memory, MAP_FAILED);
  EXPECT_EQ(std::memcmp(memory, frame->bytes().data(), frame->bytes().size()), 0);
  munmap(memory, size);
}

TEST_P(KernelCamera, EveryControlIsSetAndReadBack) {
  int tried = 0;
  V4l2Device& device = *camera->device();
  const auto controls = ListControls(device);
  ASSERT_TRUE(controls) << ToString(controls.error());
  for (const V4l2Control& control : *controls) {
    if (control.read_only || control.inactive || control.type == ControlType::button) continue;
    // vivid's own knobs for errors and disconnection are not those of a camera.
    if ((control.id & 0x0fff0000U) == 0x00f00000U || control.id >= 0x0f000000U) continue;
    const auto before = ReadControl(device, control);
    if (!before) continue;
    for (const std::int64_t value : {control.min, control.max, *before}) {
      if (!control.menu.empty() && std::none_of(control.menu.begin(), control.menu.end(),
                                                [&](const auto& e) { return e.value == value; }))
        continue;
      const auto made = WriteControl(device, control, value);
      ASSERT_TRUE(made) << control.name << ": " << ToString(made.error());
      EXPECT_EQ(*made, value) << control.name;
    }
    ++tried;
    if (control.max < INT64_MAX) {
      EXPECT_FALSE(WriteControl(device, control, control.max + 1)) << control.name;
    }
  }
  EXPECT_GE(tried, 3);
}

std::size_t Descriptors() {
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator()));
}
std::size_t VideoMappings() {
  std::ifstream maps("/proc/self/maps");
  std::size_t count = 0;
  for (std::string line; std::getline(maps, line);)
    count += line.find("/dev/video") != std::string::npos ? 1 : 0;
  return count;
}

class KernelCycles : public ::testing::Test {};

TEST_F(KernelCycles, OpeningStreamingAndClosingHoldsNothing) {
  const int cycles = std::stoi(Environment("LAB_CYCLES", "1000"));
  const std::size_t before = Descriptors();
  Rig rig;
  for (int cycle = 0; cycle < cycles; ++cycle) {
    auto camera = rig.Open(OptionsFor(Formats().front()));
    ASSERT_TRUE(camera) << cycle << ": " << ToString(camera.error());
    if (cycle % 100 == 0) {
      EXPECT_GE(VideoMappings(), 2U);
      const auto frame =
          (*camera)->stream()->Next(*rig.clock, rig.clock->Now().mono_ns + 20'000'000'000, {});
      ASSERT_TRUE(frame) << ToString(frame.error());
    }
    camera->reset();
    ASSERT_EQ(Descriptors(), before) << cycle;
    ASSERT_EQ(VideoMappings(), 0U) << cycle;
  }
  fmt::print("figure: {} cycles of open, stream, close: no descriptor and no mapping left\n",
             cycles);
}

void SetAuthorized(const std::string& value) {
  for (const auto& entry : fs::directory_iterator("/sys/bus/usb/devices")) {
    std::string product;
    std::ifstream(entry.path() / "idProduct") >> product;
    if (product == "0102") std::ofstream(entry.path() / "authorized") << value << std::flush;
  }
}

class UsbCamera : public KernelCamera {};
INSTANTIATE_TEST_SUITE_P(Formats, UsbCamera, ::testing::ValuesIn(Formats()),
                         [](const auto& instance) { return instance.param; });

// The picture is as bright as the exposure that its maker was set to.
double Brightness(const Frame& frame) {
  const EncodedFile& file = frame.files.front();
  const cv::Mat picture = DecodePicture(file.extension, file.bytes).value();
  return cv::mean(picture.rowRange(picture.rows / 2, picture.rows))[1];  // green
}

TEST_P(UsbCamera, AnExposureThatWasSetIsSeenInThePicture) {
  double darker = -1;
  for (const double exposure_us : {1000.0, 6000.0, 15'000.0}) {
    ASSERT_TRUE(camera->Configure({.exposure_us = exposure_us, .gain = {}}));
    const auto frame = camera->Grab({});
    ASSERT_TRUE(frame) << ToString(frame.error());
    EXPECT_EQ(frame->applied.exposure_us, exposure_us);
    const double brightness = Brightness(*frame);
    EXPECT_GT(brightness, darker + 10) << exposure_us;
    darker = brightness;
  }
}

TEST_P(UsbCamera, AReplugInMidStreamIsRecovered) {
  ASSERT_TRUE(camera->Configure({.exposure_us = 5000.0, .gain = {}}));
  const auto before = camera->Grab({});
  ASSERT_TRUE(before) << ToString(before.error());
  std::jthread hand([&] {
    SetAuthorized("0");
    rig.clock->SleepFor(2'000'000'000);
    SetAuthorized("1");
  });
  std::uint64_t last = before->sensor_sequence;
  while (camera->counters().restarts == 0) {
    const auto frame = camera->Grab({});
    ASSERT_TRUE(frame) << ToString(frame.error());
    EXPECT_GT(frame->sensor_sequence, last);
    EXPECT_EQ(frame->applied.exposure_us, 5000);
    last = frame->sensor_sequence;
  }
  const auto after = camera->Grab({});
  ASSERT_TRUE(after) << ToString(after.error());
}

TEST_P(UsbCamera, ACameraThatStaysAwayIsAFaultUntilItIsBack) {
  V4l2CameraOptions options = OptionsFor(GetParam());
  options.config.reconnect_ms = 500;
  camera.reset();
  auto opened = rig.Open(options);
  ASSERT_TRUE(opened) << ToString(opened.error());
  SetAuthorized("0");
  const auto away = (*opened)->Grab({});
  SetAuthorized("1");
  ASSERT_FALSE(away);
  EXPECT_EQ(away.error().kind, ErrorKind::device);
  EXPECT_FALSE(away.error().mend.empty());
  Result<Frame> back = (*opened)->Grab({});
  for (int i = 0; i < 20 && !back; ++i) back = (*opened)->Grab({});
  EXPECT_TRUE(back) << ToString(back.error());
}

// vivid draws bars of known colours: every format must show the same ones.
class ColourBars : public ::testing::Test {};

TEST_F(ColourBars, AreTheSameInEveryFormat) {
  std::map<std::string, cv::Mat> pictures;
  Rig rig;
  for (const std::string& format : Formats()) {
    auto camera = rig.Open(OptionsFor(format));
    ASSERT_TRUE(camera) << ToString(camera.error());
    const auto frame = (*camera)->Grab({});
    ASSERT_TRUE(frame) << ToString(frame.error());
    const EncodedFile& file = frame->files.front();
    const auto picture = DecodePicture(file.extension, file.bytes);
    ASSERT_TRUE(picture) << ToString(picture.error());
    pictures[format] = *picture;
    if (const char* out = std::getenv("LAB_PICTURES"))
      std::ofstream(fs::path(out) / (format + "." + file.extension), std::ios::binary)
          .write(reinterpret_cast<const char*>(file.bytes.data()),
                 static_cast<std::streamsize>(file.bytes.size()));
  }
  ASSERT_TRUE(pictures.contains("RGB3"));
  const cv::Mat& reference = pictures.at("RGB3");
  int colours = 0;
  for (const auto& [format, picture] : pictures) {
    for (int bar = 0; bar < 8; ++bar) {
      const int x = reference.cols * (2 * bar + 1) / 16, y = reference.rows * 7 / 8;
      const auto is = picture.at<cv::Vec3b>(y, x);
      const auto expected = reference.at<cv::Vec3b>(y, x);
      colours += expected[0] != expected[2] ? 1 : 0;
      for (int c = 0; c < 3; ++c) {
        const int value = format == "GREY" ? 0 : std::abs(is[c] - expected[c]);
        EXPECT_LE(value, 4) << format << ", bar " << bar << ", channel " << c << ": " << int{is[c]}
                            << " for " << int{expected[c]};
      }
    }
  }
  EXPECT_GE(colours, 4);
}

}  // namespace
}  // namespace scan
