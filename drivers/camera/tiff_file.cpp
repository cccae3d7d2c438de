#include "drivers/camera/tiff_file.h"

#include <sys/mman.h>
#include <tiffio.h>
#include <unistd.h>

#include <bit>
#include <cstdarg>
#include <cstdio>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <string>

#include "drivers/camera/stated_size.h"

namespace scan {
namespace {

int OnTiffError(TIFF*, void* text, const char*, const char* format, va_list arguments) {
  char line[160];
  std::vsnprintf(line, sizeof line, format, arguments);
  auto& first = *static_cast<std::string*>(text);
  if (first.empty()) first = line;
  return 1;  // nothing more is said anywhere
}
int OnTiffWarning(TIFF*, void*, const char*, const char*, va_list) { return 1; }

// A file in memory that holds `bytes`, at its beginning; -1 when there is no room.
int MemoryFile(std::span<const std::byte> bytes) {
  const int file = memfd_create("tiff", MFD_CLOEXEC);
  if (file < 0) return -1;
  while (!bytes.empty()) {
    const ssize_t written = write(file, bytes.data(), bytes.size());
    if (written <= 0) {
      close(file);
      return -1;
    }
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  lseek(file, 0, SEEK_SET);
  return file;
}

using Options = std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)>;
using File = std::unique_ptr<TIFF, decltype(&TIFFClose)>;

}  // namespace

Result<cv::Mat> DecodeTiffFile(std::span<const std::byte> bytes) {
  std::string text;
  const auto bad = [&text](const char* what) {
    return BadInput("not a readable TIFF: " + (text.empty() ? what : text), "tif",
                    "copy or write the picture again");
  };
  const int memory = MemoryFile(bytes);
  if (memory < 0)
    return Failed("no memory for a TIFF picture", std::to_string(bytes.size()) + " bytes",
                  "end other programs");
  const Options options(TIFFOpenOptionsAlloc(), TIFFOpenOptionsFree);
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), OnTiffError, &text);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), OnTiffWarning, nullptr);
  const File file(TIFFFdOpenExt(memory, "picture", "rm", options.get()), TIFFClose);
  if (!file) {
    close(memory);
    return bad("no TIFF head");
  }
  std::uint32_t w = 0, h = 0;
  TIFFGetField(file.get(), TIFFTAG_IMAGEWIDTH, &w);
  TIFFGetField(file.get(), TIFFTAG_IMAGELENGTH, &h);
  auto rgba = PictureOfStatedSize(w, h, CV_8UC4);  // in words, low byte red
  if (!rgba) return bad(rgba.error());
  auto bgr = PictureOfStatedSize(w, h, CV_8UC3);
  if (!bgr) return bad(bgr.error());
  // In stored order, whatever the file says of its orientation.
  TIFFSetField(file.get(), TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
  if (!TIFFReadRGBAImageOriented(file.get(), w, h, rgba->ptr<std::uint32_t>(), ORIENTATION_TOPLEFT,
                                 1))
    return bad("its pixels do not decode");
  static_assert(std::endian::native == std::endian::little);
  cv::cvtColor(*rgba, *bgr, cv::COLOR_RGBA2BGR);
  return *bgr;
}

}  // namespace scan
