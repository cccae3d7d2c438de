#include "drivers/camera/jpeg_decode.h"

#include <jerror.h>
#include <jpeglib.h>

#include <algorithm>
#include <csetjmp>
#include <cstdio>
#include <string>
#include <vector>

#include "drivers/camera/encode_picture.h"
#include "drivers/camera/stated_size.h"

namespace scan {
namespace {

struct JpegFault {
  jpeg_error_mgr manager;  // first: libjpeg hands out its address
  std::jmp_buf jump;
  char text[JMSG_LENGTH_MAX];
};

[[noreturn]] void OnError(j_common_ptr info) {
  auto* error = reinterpret_cast<JpegFault*>(info->err);
  info->err->format_message(info, error->text);
  std::longjmp(error->jump, 1);
}

// Damaged data are warnings to libjpeg; here they are errors. Stray bytes between segments are not
// damage: many cameras leave padding there.
void OnMessage(j_common_ptr info, int level) {
  if (level < 0 && info->err->msg_code != JWRN_EXTRANEOUS_DATA) OnError(info);
}

struct JpegHead {
  std::uint32_t w = 0, h = 0;
  bool has_huffman_tables = false;
};

// A decoder between setjmp and longjmp: plain C, nothing here has a destructor.
struct JpegDecoder {
  jpeg_decompress_struct info;
  JpegFault error;
};

// Reads the header, then does `work`; false when libjpeg found an error on the way.
// Precondition: nothing in `work` has a destructor.
template <class Work>
bool Decode(JpegDecoder& decoder, std::span<const std::byte> bytes, const Work& work) {
  decoder.info.err = jpeg_std_error(&decoder.error.manager);
  decoder.error.manager.error_exit = OnError;
  decoder.error.manager.emit_message = OnMessage;
  decoder.error.text[0] = 0;
  if (setjmp(decoder.error.jump) != 0) {
    jpeg_destroy_decompress(&decoder.info);
    return false;
  }
  jpeg_create_decompress(&decoder.info);
  jpeg_mem_src(&decoder.info, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&decoder.info, TRUE);
  work(decoder.info);
  jpeg_destroy_decompress(&decoder.info);
  return true;
}

bool ReadHead(JpegDecoder& decoder, std::span<const std::byte> bytes, JpegHead* head) {
  return Decode(decoder, bytes, [head](const jpeg_decompress_struct& info) {
    head->w = info.image_width;
    head->h = info.image_height;
    head->has_huffman_tables = info.dc_huff_tbl_ptrs[0] != nullptr;
  });
}

bool ReadPixels(JpegDecoder& decoder, std::span<const std::byte> bytes, unsigned char* bgr,
                std::size_t stride, std::size_t* used) {
  return Decode(decoder, bytes, [=](jpeg_decompress_struct& info) {
    info.out_color_space = JCS_EXT_BGR;
    jpeg_start_decompress(&info);
    while (info.output_scanline < info.output_height) {
      JSAMPROW row = bgr + stride * info.output_scanline;
      jpeg_read_scanlines(&info, &row, 1);
    }
    jpeg_finish_decompress(&info);
    *used = bytes.size() - info.src->bytes_in_buffer;
  });
}

tl::unexpected<Error> Corrupt(const std::string& what) {
  return DeviceFault("the camera sent a damaged JPEG: " + what, "camera",
                     "check cable, hub and power supply; a lower frame rate may help");
}

Result<JpegHead> HeadOf(std::span<const std::byte> bytes) {
  JpegDecoder decoder{};
  JpegHead head;
  if (bytes.size() < 4) return Corrupt("it is empty");
  if (!ReadHead(decoder, bytes, &head)) return Corrupt(decoder.error.text);
  if (!IsPictureSize(head.w, head.h)) return Corrupt("its size is absurd");
  return head;
}

// The four standard tables (ITU-T T.81, Annex K), taken from a picture that libjpeg writes.
Result<std::vector<std::byte>> StandardHuffmanTables() {
  SCAN_TRY(const EncodedFile picture,
           EncodePicture(cv::Mat(8, 8, CV_8UC3, cv::Scalar::all(0)), "jpg", 90));
  std::vector<std::byte> tables;
  const auto& b = picture.bytes;
  for (std::size_t at = 2; at + 4 <= b.size() && b[at] == std::byte{0xff};) {
    const std::size_t length = 2 + (std::to_integer<std::size_t>(b[at + 2]) << 8) +
                               std::to_integer<std::size_t>(b[at + 3]);
    if (at + length > b.size() || b[at + 1] == std::byte{0xda}) break;
    const auto from = b.begin() + static_cast<std::ptrdiff_t>(at);
    if (b[at + 1] == std::byte{0xc4})
      tables.insert(tables.end(), from, from + static_cast<std::ptrdiff_t>(length));
    at += length;
  }
  return tables;
}

}  // namespace

Result<cv::Mat> DecodeJpegStrictly(std::span<const std::byte> bytes, std::size_t* used) {
  SCAN_TRY(const JpegHead head, HeadOf(bytes));
  auto picture = PictureOfStatedSize(head.w, head.h, CV_8UC3);
  if (!picture) return Corrupt(picture.error());
  JpegDecoder decoder{};
  std::size_t length = 0;
  if (!ReadPixels(decoder, bytes, picture->data, picture->step, &length))
    return Corrupt(decoder.error.text);
  if (used) *used = length;
  return *picture;
}

Result<EncodedFile> JpegFileOf(std::span<const std::byte> bytes, int w, int h) {
  SCAN_TRY(const JpegHead head, HeadOf(bytes));
  if (std::int64_t{head.w} != w || std::int64_t{head.h} != h)
    return Corrupt("it is " + std::to_string(head.w) + " x " + std::to_string(head.h) + ", not " +
                   std::to_string(w) + " x " + std::to_string(h));
  std::size_t length = 0;
  SCAN_TRY(const cv::Mat decoded, DecodeJpegStrictly(bytes, &length));
  bytes = bytes.first(length);
  EncodedFile file{"jpg", {}};
  file.bytes.reserve(bytes.size() + 512);
  file.bytes.assign(bytes.begin(), bytes.begin() + 2);  // SOI
  if (!head.has_huffman_tables) {
    SCAN_TRY(const auto tables, StandardHuffmanTables());
    file.bytes.insert(file.bytes.end(), tables.begin(), tables.end());
  }
  file.bytes.insert(file.bytes.end(), bytes.begin() + 2, bytes.end());
  return file;
}

}  // namespace scan
