#include "reconstruction/pipeline/find_fiducials.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "drivers/base/files.h"
#include "reconstruction/fiducials/find_bead_images.h"
#include "reconstruction/fiducials/find_beads.h"

namespace scan {
namespace {

constexpr const char* kBeadsSchema = "scanstation.beads/1";

Status CheckFiducials(const FiducialOptions& options, const Volume* volume) {
  if (options.bead_mm && !options.beads.empty())
    return BadInput("both a diameter and a file of beads", "--bead-mm", "give one of the two");
  if (!options.bead_mm && options.beads.empty())
    return BadInput("a colour of beads, but no beads of the CT", "--bead-colour",
                    "give --bead-mm with a volume, or --beads with a file");
  if (!options.bead_colour)
    return BadInput("beads without a colour cannot be told in the photographs",
                    options.bead_mm ? "--bead-mm" : "--beads", "give --bead-colour, as #rrggbb");
  if (options.bead_mm && !volume)
    return BadInput("beads are looked for in a volume, and none is given", "--bead-mm",
                    "give --volume, or --beads with a file");
  return {};
}

}  // namespace

Result<BeadFindings> FindFiducials(const FiducialOptions& options, const Volume* volume,
                                   const PhotoSet& photos, const ProgressFn& progress,
                                   std::stop_token stop) {
  SCAN_CHECK(CheckFiducials(options, volume));
  BeadFindings findings;
  Report(progress, "beads", 0.0);
  if (options.bead_mm) {
    FindBeadsOptions find;
    find.diameter_mm = *options.bead_mm;
    SCAN_TRY(findings.beads, FindBeads(*volume, find));
  } else {
    SCAN_TRY(findings.beads, ReadBeads(options.beads));
  }
  BeadColourOptions colour;
  colour.colour = *options.bead_colour;
  findings.images.resize(photos.photos.size());
  std::vector<char> read(photos.photos.size(), 0);
  tbb::parallel_for(std::size_t{0}, photos.photos.size(), [&](std::size_t i) {
    if (stop.stop_requested()) return;
    cv::Mat picture;
    try {
      picture = cv::imread(photos.photos[i].path.string(),
                           cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
    } catch (const cv::Exception&) {
      picture.release();
    }
    if (picture.empty()) return;
    read[i] = 1;
    findings.images[i] = FindBeadImages(picture, colour);
  });
  if (stop.stop_requested()) return Cancelled("beads");
  for (std::size_t i = 0; i < read.size(); ++i)
    if (!read[i])
      return BadInput("the picture cannot be read", photos.photos[i].path.string(),
                      "give a whole PNG, JPEG or TIFF");
  return findings;
}

Status WriteBeads(const std::filesystem::path& path, const std::vector<Bead>& beads) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Bead& bead : beads)
    list.push_back({{"centre", {bead.centre.x(), bead.centre.y(), bead.centre.z()}},
                    {"radius_mm", bead.radius_mm},
                    {"sigma_mm", bead.sigma_mm},
                    {"residual_mm", bead.residual_mm}});
  const nlohmann::ordered_json document{{"schema", kBeadsSchema}, {"units", "mm"}, {"beads", list}};
  return WriteFileDurably(path, document.dump(2) + "\n");
}

Result<std::vector<Bead>> ReadBeads(const std::filesystem::path& path) {
  SCAN_TRY(const std::string text, ReadTextFile(path));
  const auto wrong = [&](const std::string& what) {
    return BadInput(what, path.string(), "give a beads.json that reconstruct wrote");
  };
  try {
    const auto document = nlohmann::json::parse(text);
    if (document.at("schema") != kBeadsSchema) return wrong("the file is no list of beads");
    std::vector<Bead> beads;
    for (const auto& item : document.at("beads")) {
      Bead bead;
      const auto& centre = item.at("centre");
      for (int a = 0; a < 3; ++a) bead.centre[a] = centre.at(static_cast<std::size_t>(a));
      bead.radius_mm = item.at("radius_mm");
      bead.sigma_mm = item.value("sigma_mm", 0.0);
      bead.residual_mm = item.value("residual_mm", 0.0);
      if (!bead.centre.allFinite() || !(bead.radius_mm > 0) || !std::isfinite(bead.radius_mm) ||
          !(bead.sigma_mm >= 0))
        return wrong(fmt::format("beads[{}]: no finite centre and positive radius", beads.size()));
      beads.push_back(bead);
    }
    if (beads.empty()) return wrong("beads: the list is empty");
    return beads;
  } catch (const nlohmann::json::exception& exception) {
    return wrong(exception.what());
  }
}

}  // namespace scan
