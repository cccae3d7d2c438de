// lab_uvc: feeds the UVC gadget of guest/uvc.sh. usage: lab_uvc   runs until it is ended; SIGUSR1
// stops sending, SIGUSR2 goes on. Every picture carries its number as 32 dark or bright squares
// along the upper edge (the lowest bit left) and is as bright as the exposure time set by the host;
// JPEG pictures repeat after 16.
#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <opencv2/core.hpp>
#include <vector>

#include "drivers/camera/encode_picture.h"
#include "tests/lab/uvc_gadget.h"

namespace {

using scan::GadgetFrame;

constexpr int kSquare = 16;        // px
constexpr int kJpegPictures = 16;  // encoded once for each brightness
constexpr int kStandardExposure = 80;

volatile sig_atomic_t g_silent = 0;
void OnSilence(int) { g_silent = 1; }
void OnGoOn(int) { g_silent = 0; }

std::uint8_t Brightness(const GadgetFrame& frame) {
  return static_cast<std::uint8_t>(std::clamp(40 + frame.exposure, 40, 220));
}

std::size_t PaintYuyv(const GadgetFrame& frame, std::uint8_t* out) {
  const std::size_t line = 2 * static_cast<std::size_t>(frame.w);
  std::array<std::uint8_t, 2 * 1920> plain{}, marked{};
  for (std::size_t x = 0; x < static_cast<std::size_t>(frame.w); ++x) {
    const bool bit = x / kSquare < 32 && ((frame.number >> (x / kSquare)) & 1U);
    plain[2 * x] = Brightness(frame);
    marked[2 * x] = x / kSquare < 32 ? (bit ? 235 : 16) : Brightness(frame);
    plain[2 * x + 1] = marked[2 * x + 1] = 128;
  }
  for (std::size_t y = 0; y < static_cast<std::size_t>(frame.h); ++y)
    std::memcpy(out + y * line, y < kSquare ? marked.data() : plain.data(), line);
  return line * static_cast<std::size_t>(frame.h);
}

class Painter {
 public:
  Painter() {  // before the camera is there: the host does not wait long for an answer
    for (std::uint32_t i = 0; i < kJpegPictures; ++i)
      JpegOf({640, 480, true, i, kStandardExposure});
  }
  std::size_t operator()(const GadgetFrame& frame, std::span<std::uint8_t> out) {
    if (g_silent) return 0;
    if (!frame.jpeg) return PaintYuyv(frame, out.data());
    const std::vector<std::byte>& jpeg = JpegOf(frame);
    const std::size_t size = std::min(jpeg.size(), out.size());
    std::memcpy(out.data(), jpeg.data(), size);
    return size;
  }

 private:
  const std::vector<std::byte>& JpegOf(const GadgetFrame& frame) {
    const int number = static_cast<int>(frame.number % kJpegPictures);
    std::vector<std::byte>& jpeg = jpegs_[{number, frame.w, Brightness(frame)}];
    if (jpeg.empty()) {
      cv::Mat picture(frame.h, frame.w, CV_8UC3, cv::Scalar::all(Brightness(frame)));
      for (int bit = 0; bit < 32; ++bit)
        picture(cv::Rect(bit * kSquare, 0, kSquare, kSquare)) =
            cv::Scalar::all((number >> bit) & 1 ? 255 : 0);
      if (auto file = scan::EncodePicture(picture, "jpg", 85)) jpeg = std::move(file->bytes);
    }
    return jpeg;
  }

  std::map<std::array<int, 3>, std::vector<std::byte>> jpegs_;
};

}  // namespace

int main() {
  struct sigaction action {};
  action.sa_handler = OnSilence;
  sigaction(SIGUSR1, &action, nullptr);
  action.sa_handler = OnGoOn;
  sigaction(SIGUSR2, &action, nullptr);
  const auto gadget = scan::UvcGadget::Open(Painter());
  if (!gadget) {
    fmt::print(stderr, "lab_uvc: {}\n", ToString(gadget.error()));
    return 1;
  }
  fmt::print("feeding\n");
  fflush(stdout);
  (*gadget)->Run();
}
