#include "reconstruction/pose/pose_exports.h"

#include <gtest/gtest.h>

#include <sstream>

#include <nlohmann/json.hpp>

#include "drivers/base/files.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/poses/poses_samples.h"

namespace scan {
namespace {

PhotoSet SamplePhotos(const std::filesystem::path& session) {
  PhotoSet set;
  set.session = session;
  set.lens_states.push_back({"c0-a0", SamplePoses().lens_states.at("c0-a0").intrinsics, {}});
  set.aims.push_back({"a0", "c0", 0, {}, {}, {}});
  for (const char* name : {"v000", "v001"}) {
    Photo photo;
    photo.id = photo.name = name;
    photo.path = session / "frames" / (photo.id + "_c0.png");
    photo.mask_path = session / "derived/masks" / (photo.id + "_c0.png");
    set.photos.push_back(photo);
  }
  return set;
}

TEST(PoseExports, TransformsAreCameraToModelInOpenGlAxes) {
  const TempFolder temp;
  const Poses poses = SamplePoses();
  std::filesystem::create_directories(temp.path() / "poses");
  ASSERT_TRUE(WriteTransforms(temp.path() / "poses", poses, SamplePhotos(temp.path() / "session")));
  const auto json =
      nlohmann::json::parse(ReadTextFile(temp.path() / "poses/transforms.json").value());
  ASSERT_EQ(json["frames"].size(), 1u);  // the rejected view is left out
  const auto& frame = json["frames"][0];
  EXPECT_EQ(frame["file_path"], "../session/frames/v000_c0.png");
  EXPECT_EQ(frame["mask_path"], "../session/derived/masks/v000_c0.png");
  EXPECT_EQ(json["fl_x"], 47.4);
  Eigen::Matrix4d model_from_camera;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) model_from_camera(r, c) = frame["transform_matrix"][r][c];
  // A point 10 mm before the camera, 2 to the right, 3 up.
  const Eigen::Vector4d in_model = model_from_camera * Eigen::Vector4d(2, 3, -10, 1);
  const Eigen::Vector3d in_camera = poses.views[0].camera_from_model * in_model.head<3>().eval();
  EXPECT_TRUE(in_camera.isApprox(Eigen::Vector3d(2, -3, 10), 1e-9)) << in_camera.transpose();
}

TEST(PoseExports, ColmapTextProjectsAsThePoseDoes) {
  const TempFolder temp;
  const Poses poses = SamplePoses();
  ASSERT_TRUE(WriteColmap(temp.path(), poses, SamplePhotos(temp.path() / "session")));
  const auto folder = temp.path() / "sparse/0";
  EXPECT_EQ(ReadTextFile(folder / "cameras.txt").value(),
            "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n"
            "1 OPENCV 16 12 47.4 47.5 8.1 5.9 0.01 -0.02 0.001 0.002\n");
  std::istringstream images(ReadTextFile(folder / "images.txt").value());
  std::string line;
  std::getline(images, line);
  std::getline(images, line);
  int id = 0, camera = 0;
  double w, x, y, z;
  Eigen::Vector3d t;
  std::string name;
  images >> id >> w >> x >> y >> z >> t.x() >> t.y() >> t.z() >> camera >> name;
  EXPECT_EQ(id, 1);
  EXPECT_EQ(camera, 1);
  EXPECT_EQ(name, "v000_c0.png");
  const CameraFromModel read(Eigen::Quaterniond(w, x, y, z).toRotationMatrix(), t);
  EXPECT_TRUE(read.matrix34().isApprox(poses.views[0].camera_from_model.matrix34(), 1e-12));
  EXPECT_TRUE(std::filesystem::exists(folder / "points3D.txt"));
}

TEST(PoseExports, RefusesASessionThatLacksThePhotograph) {
  const TempFolder temp;
  PhotoSet photos = SamplePhotos(temp.path());
  photos.photos.erase(photos.photos.begin());
  EXPECT_EQ(WriteTransforms(temp.path(), SamplePoses(), photos).error().kind, ErrorKind::bad_input);
  EXPECT_EQ(WriteColmap(temp.path(), SamplePoses(), photos).error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace scan
