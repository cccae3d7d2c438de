// The pictures of the report: overlays and renderings.
#pragma once

#include <opencv2/core.hpp>

#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "reconstruction/mesh/atlas_mesh.h"

namespace scan {

// The part of a picture that shows the specimen.
struct Crop {
  cv::Rect full_px;       // in the photograph
  double scale = 1;       // report pixels per photograph pixel
  cv::Size size() const;  // of the picture in the report
};

// Around everything set in either mask (CV_8U, same size), with a margin, at most `longest_px` wide
// or high. The whole picture when both are empty.
Crop CropAround(const cv::Mat& mask_a, const cv::Mat& mask_b, int longest_px);

cv::Mat CropOf(const cv::Mat& picture, const Crop& crop);

// The camera whose picture is the crop.
Intrinsics CropIntrinsics(const Intrinsics& intrinsics, const Crop& crop);

// The photograph (dimmed) with the photo contour in green and the projected model contour in
// magenta; where they agree both are seen side by side as white. BGR.
cv::Mat DrawOverlay(const cv::Mat& photo_crop, const cv::Mat& photo_mask_crop,
                    const cv::Mat& model_mask_crop);

// The textured model as the camera sees it, on white; texels are sampled bilinearly. BGR.
// Precondition: albedo is CV_8UC3, square.
cv::Mat RenderTextured(const AtlasMesh& atlas, const cv::Mat& albedo,
                       const CameraFromModel& camera_from_model, const Intrinsics& intrinsics);

// Each class of provenance (CV_16UC3: class, view, incidence) in its own colour, see the legend of
// the report. BGR.
cv::Mat ProvenanceColours(const cv::Mat& provenance);

}  // namespace scan
