#include "drivers/camera/decode_picture.h"

#include <string>

#include "drivers/camera/jpeg_decode.h"
#include "drivers/camera/png_file.h"
#include "drivers/camera/tiff_file.h"

namespace scan {

Result<cv::Mat> DecodePicture(std::string_view extension, std::span<const std::byte> bytes) {
  if (extension == "jpg") return DecodeJpegStrictly(bytes);
  if (extension == "png") return DecodePngFile(bytes);
  if (extension == "tif") return DecodeTiffFile(bytes);
  return BadInput("unknown picture format", std::string(extension), "give a jpg, png or tif");
}

}  // namespace scan
