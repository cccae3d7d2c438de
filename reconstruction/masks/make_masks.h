// Photographs to masks: given ones, plate difference, or GrabCut.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <span>
#include <stop_token>
#include <vector>

#include "acquisition/session/photo_set.h"
#include "drivers/base/progress.h"
#include "drivers/base/result.h"
#include "reconstruction/masks/mask.h"

namespace scan {

struct MaskOptions {
  int band_px = 20;         // half width of the band that the graph cut decides, [1, 200]
  double smoothness = 2.5;  // nats per pair of neighbouring pixels without contrast, [0, 100]
  double noise_floor = 1;   // sRGB codes: noise of one channel of (photo - plate) is never below
  double keep_share =
      0.002;            // components smaller than this share of the largest are specks, [0, 1]
  int min_hole_px = 6;  // smaller holes are closed; open ones show background, [0, ...]
  int grabcut_size_px = 480;  // longest side at which GrabCut runs, [64, ...]
};

// What of `photo` is specimen, with the share covered at its boundary: 8-bit sRGB pictures, mixed
// in linear light.
// With a plate: difference in units of its noise after the exposure is matched on the picture's
// rim, a graph cut within band_px of the thresholded difference, then coverage as the projection of
// photo - background on foreground - background (nearest sure foreground, plate corrected by the
// nearest sure background). Without one: GrabCut on a reduced picture, seeded by what differs from
// the rim, then the same coverage step with the background taken from the photograph.
// `ignore` (CV_8U, non-zero = no evidence) may be empty; it is kept in the mask.
// Errors: bad_input for a photo that is not CV_8UC3 or under 16 px, a plate or ignore picture of
// another size or type, options out of range; failed when nothing or nearly everything differs.
// Thread contract: pure with a plate. Without one it seeds cv::theRNG() of the calling thread.
// Source: Boykov and Jolly 2001 (cut), Rother et al. 2004 (GrabCut).
Result<Mask> MakeMask(const cv::Mat& photo, const cv::Mat& plate, const cv::Mat& ignore,
                      const MaskOptions& options = {});

// A mask file as it is: any 8-bit picture (colour is turned to grey), 0 outside; a file with only 0
// and one other value is binary and that value becomes 255.
// Errors: bad_input for an unreadable file, another depth than 8 bit, another size than `size`.
Result<Mask> LoadMask(const std::filesystem::path& path, cv::Size size);

// One mask per photo, in their order: the given one, else from the plate of its aim, else GrabCut.
// Same bytes for any number of threads. `progress` is called from one thread at a time.
// Errors: as MakeMask and LoadMask, naming the file; cancelled.
// Thread contract: parallel inside over photographs with plates.
Result<std::vector<Mask>> MakeMasks(const PhotoSet& photos, const MaskOptions& options = {},
                                    const ProgressFn& progress = {}, std::stop_token stop = {});

// SESSION/derived/masks/NAME.png for every photo (existing files are replaced whole).
// Precondition: one mask per photo.
Status SaveMasks(const PhotoSet& photos, std::span<const Mask> masks);

}  // namespace scan
