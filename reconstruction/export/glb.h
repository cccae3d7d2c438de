// The textured model as one binary glTF 2.0 file.
#pragma once

#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "drivers/base/frames.h"
#include "drivers/base/result.h"
#include "reconstruction/mesh/atlas_mesh.h"

namespace scan {

// A picture as its file holds it.
struct EncodedPicture {
  std::vector<unsigned char> bytes;
  std::string mime_type;  // image/png or image/jpeg
};

// Errors: bad_input for anything but a CV_8UC3 or CV_8UC1 picture.
Result<EncodedPicture> EncodePng(const cv::Mat& bgr);
// `quality` in [1, 100].
Result<EncodedPicture> EncodeJpeg(const cv::Mat& bgr, int quality);

struct GlbOptions {
  std::string name = "specimen";
  // Turns the model upright; without it the model's +z is taken for up.
  std::optional<TableFromModel> table_from_model;
  // KHR_materials_unlit: viewers show the colours as they are. Off: a rough dielectric under the
  // viewer's light, which every viewer knows.
  bool unlit = false;
  std::string copyright;                        // asset.copyright
  std::map<std::string, std::string> metadata;  // asset.extras
};

// Writes vertices in model mm; the root node turns table +z to +Y and scales to metres. Normals are
// smooth across seams, faces two-sided, the texture embedded and sRGB.
// Errors: bad_input for a mesh without faces, values that are not finite or more than 4 GB; failed
// when the file cannot be written.
// Thread contract: pure. Source: glTF 2.0, ISO/IEC 12113:2022.
Status WriteGlb(const std::filesystem::path& path, const AtlasMesh& atlas,
                const EncodedPicture& albedo, const GlbOptions& options = {});

// The same with the albedo (CV_8UC3, BGR, sRGB) as PNG.
Status WriteGlb(const std::filesystem::path& path, const AtlasMesh& atlas,
                const cv::Mat& albedo_bgr, const GlbOptions& options = {});

}  // namespace scan
