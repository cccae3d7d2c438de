// Makes a session of photographs taken elsewhere.
#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>

#include "drivers/base/clock.h"
#include "drivers/base/progress.h"
#include "drivers/base/result.h"

namespace scan {

struct ImportRequest {
  std::filesystem::path photos;      // folder; may be empty with `transforms`
  std::filesystem::path masks;       // folder; each photograph has one of the same base name
  std::filesystem::path ignore;      // folder; a photograph may have one of the same base name
  std::filesystem::path transforms;  // transforms.json (instant-ngp, nerfstudio)
  std::filesystem::path colmap;      // folder of cameras.txt and images.txt; not with `transforms`
  std::filesystem::path out;         // the session to be made
  bool force = false;                // replaces an existing session, nothing else
  // For photographs alone:
  std::optional<double> sensor_width_mm;     // turns an EXIF focal length in mm into pixels
  std::optional<double> approx_distance_mm;  // camera to specimen; transforms.json may say it too
  Timestamp now;                             // of the documents
  std::string software_version;
};

struct ImportReport {
  std::filesystem::path session;  // absolute
  int photographs = 0;
  int cameras = 0;
  int with_pose = 0;
  int with_mask = 0;
};

// Photographs are copied byte for byte, masks go to derived/masks; pixels stay in stored order. A
// pose that comes without prior_sigma gets 1 degree and 10 mm, written into session.json. The
// session appears whole or not at all.
// Errors: bad_input for a missing file, an unreadable picture, sizes that do not match, an empty
// folder, a focal length that nothing tells, an existing output; cancelled.
// Thread contract: pure.
Result<ImportReport> ImportPhotographs(const ImportRequest& request,
                                       const ProgressFn& progress = {}, std::stop_token stop = {});

}  // namespace scan
