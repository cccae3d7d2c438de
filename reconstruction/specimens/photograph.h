// What a camera at the station sees of a synthetic specimen.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "reconstruction/mesh/mesh.h"
#include "reconstruction/specimens/specimen.h"

namespace scan {

struct PhotographOptions {
  double edge_mm = 0.12;  // of the surface that is drawn
  // Diffuse box, fixed to the camera: a surface whose normal makes the cosine c with the direction
  // up-left-forward gets the share 1 - shading * (1 - c) / 2 of the light. 0 is perfectly even.
  double shading = 0.25;
  double vignetting = 0.06;  // share of the light lost in the corners
};

// Built once per specimen and shared by all pictures. Thread contract: read only.
struct PhotographScene {
  std::shared_ptr<const Specimen> specimen;
  PhotographOptions options;
  TriangleMesh surface;
  std::vector<Eigen::Vector3d> normals;  // per vertex
};
// Precondition: a specimen.
PhotographScene MakePhotographScene(std::shared_ptr<const Specimen> specimen,
                                    const PhotographOptions& options = {});

struct PhotographConditions {
  bool specimen_present = true;  // false: the background plate
  bool light_on = true;
  double exposure = 1;  // relative; at 1 a white surface comes out just below clipping
};

// CV_8UC3, BGR, sRGB, at the size of `intrinsics`, without noise. The specimen's own albedo at
// every sampled surface point; its outline blends in linear light by TrueCoverage. Background: a
// grey-blue gradient with a faint texture, fixed to the picture. Same bytes for any number of
// threads.
cv::Mat RenderPhotograph(const PhotographScene& scene, const CameraFromModel& camera_from_model,
                         const Intrinsics& intrinsics, const PhotographConditions& conditions = {});

// The exact mask: CV_8U, share of each pixel that the specimen covers.
cv::Mat TrueCoverage(const PhotographScene& scene, const CameraFromModel& camera_from_model,
                     const Intrinsics& intrinsics);

}  // namespace scan
