#include "drivers/camera/encode_picture.h"

#include <jpeglib.h>

#include <csetjmp>
#include <cstdio>
#include <cstdlib>

#include "drivers/camera/png_file.h"

namespace scan {
namespace {

struct JpegError {
  jpeg_error_mgr manager;  // first: libjpeg hands out its address
  std::jmp_buf jump;
};

void OnJpegError(j_common_ptr info) {
  std::longjmp(reinterpret_cast<JpegError*>(info->err)->jump, 1);
}

// Plain C between setjmp and longjmp: nothing here has a destructor. Gives false on an error;
// `out` is malloc'ed by libjpeg and may be set in both cases.
bool CompressJpeg(const unsigned char* bgr, std::size_t stride, int w, int h, int quality,
                  unsigned char** out, unsigned long* size) {
  jpeg_compress_struct info;
  JpegError error;
  info.err = jpeg_std_error(&error.manager);
  error.manager.error_exit = OnJpegError;
  if (setjmp(error.jump) != 0) {
    jpeg_destroy_compress(&info);
    return false;
  }
  jpeg_create_compress(&info);
  jpeg_mem_dest(&info, out, size);
  info.image_width = static_cast<JDIMENSION>(w);
  info.image_height = static_cast<JDIMENSION>(h);
  info.input_components = 3;
  info.in_color_space = JCS_EXT_BGR;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, quality, TRUE);
  info.comp_info[0].h_samp_factor = 1;  // 4:4:4
  info.comp_info[0].v_samp_factor = 1;
  jpeg_start_compress(&info, TRUE);
  while (info.next_scanline < info.image_height) {
    // libjpeg only reads the row.
    JSAMPROW row = const_cast<JSAMPROW>(bgr + stride * info.next_scanline);
    jpeg_write_scanlines(&info, &row, 1);
  }
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
  return true;
}

}  // namespace

Result<EncodedFile> EncodePicture(const cv::Mat& bgr, const std::string& format, int jpeg_quality) {
  EncodedFile file;
  file.extension = format;
  if (format == "jpg") {
    unsigned char* out = nullptr;
    unsigned long size = 0;
    const bool good =
        CompressJpeg(bgr.data, bgr.step, bgr.cols, bgr.rows, jpeg_quality, &out, &size);
    if (good) {
      const auto* bytes = reinterpret_cast<const std::byte*>(out);
      file.bytes.assign(bytes, bytes + size);
    }
    std::free(out);
    if (!good) return Failed("picture could not be encoded", "jpg", "check the picture's size");
    return file;
  }
  if (format != "png") return BadInput("unknown format", format, "choose jpg or png");
  SCAN_TRY(file.bytes, EncodePngFile(bgr));
  return file;
}

}  // namespace scan
