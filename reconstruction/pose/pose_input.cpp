#include "reconstruction/pose/pose_input.h"

#include <fmt/format.h>

namespace scan {
namespace {

Status CheckMesh(const TriangleMesh& mesh) {
  if (mesh.faces.empty())
    return BadInput("the mesh has no faces", "mesh", "give the surface of the specimen");
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (!mesh.vertices[i].allFinite())
      return BadInput("the mesh has a vertex that is not a number",
                      fmt::format("mesh, vertex {}", i), "clean the surface or make it again");
  }
  for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
    for (const std::uint32_t index : mesh.faces[i]) {
      if (index >= mesh.vertices.size())
        return BadInput("a face names a vertex that does not exist",
                        fmt::format("mesh, face {}", i), "make the surface again");
    }
  }
  return {};
}

}  // namespace

Status CheckPoseInput(const TriangleMesh& mesh, const PhotoSet& photos,
                      std::span<const Mask> masks) {
  SCAN_CHECK(CheckMesh(mesh));
  if (photos.photos.empty())
    return BadInput("no photographs", "session", "capture or import photographs first");
  if (masks.size() != photos.photos.size())
    return BadInput(fmt::format("{} masks for {} photographs", masks.size(), photos.photos.size()),
                    "masks", "make one mask for each photograph");
  for (std::size_t i = 0; i < masks.size(); ++i) {
    const Photo& photo = photos.photos[i];
    if (photo.aim < 0 || photo.aim >= static_cast<int>(photos.aims.size()))
      return BadInput("a photograph without an aim", photo.name, "import the session again");
    const Intrinsics& in = photos.intrinsics(photo);
    if (!(in.w > 0 && in.h > 0 && in.fl_x > 0 && in.fl_y > 0))
      return BadInput("a camera without size or focal length", photo.name,
                      "give w, h, fl_x, fl_y, cx, cy");
    const cv::Mat& coverage = masks[i].coverage;
    if (coverage.empty()) continue;
    const auto wrong = [&](const cv::Mat& m) {
      return m.type() != CV_8U || m.cols != in.w || m.rows != in.h;
    };
    if (wrong(coverage) || (!masks[i].ignore.empty() && wrong(masks[i].ignore)))
      return BadInput(fmt::format("a mask of {} x {} for a photograph of {} x {}", coverage.cols,
                                  coverage.rows, in.w, in.h),
                      photo.name, "make the mask from this photograph, 8 bits a pixel");
  }
  return {};
}

}  // namespace scan
