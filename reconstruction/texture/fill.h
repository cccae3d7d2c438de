// Colour where no photograph sees the surface, and around the charts.
#pragma once

#include <opencv2/core.hpp>

#include "reconstruction/texture/texels.h"

namespace scan {

// Grows colours from the measured boundary over neighbours on the surface, then smooths the filled
// texels (Ijiri 2018, Fig 11 b and c), in linear light. Parts of the surface without any measured
// texel take the mean colour. Filled texels get TexelClass::filled.
void FillUnseen(const Texels& texels, int smoothing_steps, Layer& result);

// Every place of the picture outside the charts takes the colour of the nearest texel.
void PadGutters(const Texels& texels, cv::Mat& albedo);

}  // namespace scan
