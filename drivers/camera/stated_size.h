// Pictures of a size that a file only states: it may be wrong.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <tl/expected.hpp>

namespace scan {

constexpr std::uint32_t kLongestSide = 32768;  // px

inline bool IsPictureSize(std::uint32_t w, std::uint32_t h) {
  return w >= 1 && h >= 1 && w <= kLongestSide && h <= kLongestSide;
}

// Without content. Errors: what is wrong with the size, for a message about the file.
// Thread contract: pure.
inline tl::expected<cv::Mat, const char*> PictureOfStatedSize(std::uint32_t w, std::uint32_t h,
                                                              int type) {
  if (!IsPictureSize(w, h)) return tl::unexpected<const char*>("its size is absurd");
  try {
    return cv::Mat(static_cast<int>(h), static_cast<int>(w), type);
  } catch (const cv::Exception&) {
    return tl::unexpected<const char*>("there is no memory for the size that it states");
  }
}

}  // namespace scan
