// What of a photograph is specimen.
#pragma once

#include <opencv2/core.hpp>

namespace scan {

// Same size as the photograph.
struct Mask {
  cv::Mat coverage;     // CV_8U: 0 outside, 255 inside, between = share covered (edge at 127.5)
  cv::Mat ignore;       // CV_8U or empty: non-zero = no evidence here
  bool binary = false;  // only 0 and one other value: contours carry pixel quantisation
};

}  // namespace scan
