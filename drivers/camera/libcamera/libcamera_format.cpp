#include "drivers/camera/libcamera/libcamera_format.h"

#include <algorithm>
#include <array>

namespace scan {
namespace {

struct Alias {
  std::string_view libcamera, v4l2;
};

constexpr std::array kAliases = {
    Alias{"MJPEG", "MJPG"},
    Alias{"YUYV", "YUYV"},
    Alias{"NV12", "NV12"},
    Alias{"R8", "GREY"},
    Alias{"R16", "Y16"},
    Alias{"RGB888", "BGR3"},
    Alias{"BGR888", "RGB3"},
    Alias{"SRGGB8", "RGGB"},
    Alias{"SBGGR8", "BA81"},
    Alias{"SGRBG8", "GRBG"},
    Alias{"SGBRG8", "GBRG"},
    Alias{"SRGGB10", "RG10"},
    Alias{"SBGGR10", "BG10"},
    Alias{"SGRBG10", "BA10"},
    Alias{"SGBRG10", "GB10"},
    Alias{"SRGGB12", "RG12"},
    Alias{"SBGGR12", "BG12"},
    Alias{"SGRBG12", "BA12"},
    Alias{"SGBRG12", "GB12"},
    Alias{"SRGGB14", "RG14"},
    Alias{"SBGGR14", "BG14"},
    Alias{"SGRBG14", "GR14"},
    Alias{"SGBRG14", "GB14"},
    Alias{"SRGGB16", "RG16"},
    Alias{"SBGGR16", "BYR2"},
    Alias{"SGRBG16", "GR16"},
    Alias{"SGBRG16", "GB16"},
    Alias{"SRGGB10_CSI2P", "pRAA"},
    Alias{"SBGGR10_CSI2P", "pBAA"},
    Alias{"SGRBG10_CSI2P", "pgAA"},
    Alias{"SGBRG10_CSI2P", "pGAA"},
    Alias{"SRGGB12_CSI2P", "pRCC"},
    Alias{"SBGGR12_CSI2P", "pBCC"},
    Alias{"SGRBG12_CSI2P", "pgCC"},
    Alias{"SGBRG12_CSI2P", "pGCC"},
};

}  // namespace

const PixelFormat* FindLibcameraFormat(std::string_view name) {
  const auto alias = std::find_if(kAliases.begin(), kAliases.end(),
                                  [&](const Alias& entry) { return entry.libcamera == name; });
  return alias == kAliases.end() ? nullptr : FindPixelFormat(alias->v4l2);
}

}  // namespace scan
