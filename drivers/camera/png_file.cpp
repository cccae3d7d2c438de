#include "drivers/camera/png_file.h"

#include <png.h>
#include <zlib.h>

#include <bit>
#include <cassert>
#include <csetjmp>
#include <cstdint>
#include <string>

#include "drivers/camera/stated_size.h"

namespace scan {
namespace {

// What stands between setjmp and longjmp has no destructor: libpng leaves by jumping.
struct PngEncoder {
  std::vector<std::byte>* out;
  char text[128];
};

[[noreturn]] void OnPngError(png_structp png, png_const_charp text) {
  auto* encoder = static_cast<PngEncoder*>(png_get_error_ptr(png));
  std::snprintf(encoder->text, sizeof encoder->text, "%s", text);
  png_longjmp(png, 1);
}
void OnPngWarning(png_structp, png_const_charp) {}

void AppendTo(png_structp png, png_bytep data, png_size_t size) {
  bool fits = true;
  try {
    auto& out = *static_cast<PngEncoder*>(png_get_io_ptr(png))->out;
    const auto* bytes = reinterpret_cast<const std::byte*>(data);
    out.insert(out.end(), bytes, bytes + size);
  } catch (const std::exception&) {
    fits = false;
  }
  if (!fits) png_error(png, "out of memory");
}
void Flush(png_structp) {}

bool WritePng(PngEncoder& encoder, const unsigned char* bgr, std::size_t stride, int w, int h,
              int bits) {
  png_structp png =
      png_create_write_struct(PNG_LIBPNG_VER_STRING, &encoder, OnPngError, OnPngWarning);
  if (!png) return false;
  png_infop info = png_create_info_struct(png);
  if (!info || setjmp(png_jmpbuf(png)) != 0) {
    png_destroy_write_struct(&png, &info);
    return false;
  }
  png_set_write_fn(png, &encoder, AppendTo, Flush);
  png_set_compression_level(png, 1);
  png_set_compression_strategy(png, Z_RLE);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_set_IHDR(png, info, static_cast<png_uint_32>(w), static_cast<png_uint_32>(h), bits,
               PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  png_set_bgr(png);
  if (bits == 16 && std::endian::native == std::endian::little) png_set_swap(png);
  for (int y = 0; y < h; ++y) png_write_row(png, bgr + stride * static_cast<std::size_t>(y));
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return true;
}

}  // namespace

Result<std::vector<std::byte>> EncodePngFile(const cv::Mat& bgr) {
  assert(!bgr.empty() && (bgr.type() == CV_8UC3 || bgr.type() == CV_16UC3));
  std::vector<std::byte> out;
  PngEncoder encoder{&out, ""};
  if (!WritePng(encoder, bgr.data, bgr.step, bgr.cols, bgr.rows, bgr.depth() == CV_16U ? 16 : 8))
    return Failed("the picture could not be written as PNG: " + std::string(encoder.text), "png",
                  "check the picture's size and the free memory");
  return out;
}

Result<cv::Mat> DecodePngFile(std::span<const std::byte> bytes) {
  const auto bad = [](const std::string& what) {
    return BadInput("not a readable PNG: " + what, "png", "copy or write the picture again");
  };
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()))
    return bad(image.message);
  auto picture = PictureOfStatedSize(image.width, image.height, CV_8UC3);
  if (!picture) {
    png_image_free(&image);
    return bad(picture.error());
  }
  image.format = PNG_FORMAT_BGR;
  image.flags |= PNG_IMAGE_FLAG_16BIT_sRGB;
  const png_color black{};  // behind transparent pixels
  if (!png_image_finish_read(&image, &black, picture->data, static_cast<png_int_32>(picture->step),
                             nullptr))
    return bad(image.message);
  return *picture;
}

}  // namespace scan
