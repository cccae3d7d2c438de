// report.html: one self-contained page that shows what was found and how well.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "acquisition/session/photo_set.h"
#include "drivers/base/result.h"
#include "reconstruction/masks/mask.h"
#include "reconstruction/mesh/atlas_mesh.h"
#include "reconstruction/pose/poses.h"

namespace scan {

// A line of a table: what, how much, and what it means.
struct Figure {
  std::string name;
  std::string value;
  std::string remark;
};

struct StageSeconds {
  std::string stage;
  double seconds = 0;
};

struct ReportInput {
  std::string title;
  std::vector<Figure> figures;       // the main table
  std::vector<StageSeconds> stages;  // in order
  std::vector<std::string> notes;    // sentences for the reader, most important first
  const PhotoSet* photos = nullptr;
  std::span<const Mask> masks;  // one per photo
  const Poses* poses = nullptr;
  const AtlasMesh* atlas = nullptr;
  const cv::Mat* albedo = nullptr;      // CV_8UC3, BGR
  const cv::Mat* provenance = nullptr;  // CV_16UC3
  std::vector<double> view_coverage;    // share of the surface taken from each photo; may be empty
};

// Preconditions: the pointers are set and agree with each other.
// Errors: bad_input for a photograph that cannot be read, failed when the page cannot be written.
// Thread contract: pure but for the file; parallel over photographs inside.
Status WriteReport(const std::filesystem::path& path, const ReportInput& input);

}  // namespace scan
