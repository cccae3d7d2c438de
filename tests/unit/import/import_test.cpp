#include "acquisition/import/import.h"

#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "acquisition/session/photo_set.h"
#include "acquisition/session/session_verify.h"
#include "drivers/base/files.h"
#include "drivers/base/rng.h"
#include "drivers/base/units.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/session/session_samples.h"

namespace scan {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// Two 16 x 12 photographs with masks, from a camera 100 mm along -y of the table that looks at its
// origin; the second after a turn of the platter by 90 degrees.
class Import : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(root() / "photos");
    fs::create_directories(root() / "masks");
    for (const char* name : {"Img 1", "img_2"}) {
      ASSERT_TRUE(
          WriteFileDurably(root() / "photos" / (std::string(name) + ".png"), SamplePng(16, 12, 9)));
      cv::Mat mask(12, 16, CV_8U, cv::Scalar(0));
      mask(cv::Rect(4, 3, 5, 6)).setTo(255);
      cv::imwrite((root() / "masks" / (std::string(name) + ".png")).string(), mask);
    }
    transforms_ = {{"fl_x", 40}, {"cx", 8}, {"cy", 6}, {"w", 16}, {"h", 12}};
    // Columns: camera x, y (up), z (backward) and centre in the table frame.
    transforms_["frames"] = {
        {{"file_path", "photos/Img 1.png"},
         {"mask_path", "masks/Img 1.png"},
         {"turntable_deg", 0},
         {"axes_sigma", {{"turntable_deg", 0.1}}},
         {"prior_sigma", {{"rotation_deg", 1.5}, {"translation_mm", 15}}},
         {"prior_sigma_view", {{"rotation_deg", 0.3}, {"translation_mm", 1}}},
         {"transform_matrix", {{1, 0, 0, 0}, {0, 0, -1, -100}, {0, 1, 0, 0}, {0, 0, 0, 1}}}},
        {{"file_path", "photos/img_2.png"},
         {"mask_path", "masks/img_2.png"},
         {"turntable_deg", 90},
         {"prior_sigma", {{"rotation_deg", 1.5}, {"translation_mm", 15}}},
         {"transform_matrix", {{0, 0, -1, -100}, {-1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 0, 1}}}}};
    request_.transforms = root() / "transforms.json";
    request_.out = root() / "out";
    request_.now = Time(0);
    request_.software_version = "0.1.0";
  }

  const fs::path& root() const { return temp_.path(); }

  Result<ImportReport> Run() {
    if (!request_.transforms.empty()) WriteText(request_.transforms, transforms_.dump());
    return ImportPhotographs(request_);
  }

  // That this import is refused as bad input, names `where`, and leaves nothing behind.
  void ExpectRefused(const std::string& where) {
    const auto report = Run();
    ASSERT_FALSE(report) << where;
    EXPECT_EQ(report.error().kind, ErrorKind::bad_input);
    EXPECT_NE(report.error().where.find(where), std::string::npos) << ToString(report.error());
    EXPECT_FALSE(fs::exists(root() / "out"));
    EXPECT_FALSE(fs::exists(root() / ".out.part"));
  }

  TempFolder temp_;
  ImportRequest request_;
  json transforms_;
};

TEST_F(Import, OpenGlAxesBecomeOpenCvAxes) {
  const auto report = Run();
  ASSERT_TRUE(IsOk(report));
  EXPECT_EQ(report->photographs, 2);
  EXPECT_EQ(report->with_pose, 2);
  const auto set = LoadPhotoSet(root() / "out");
  ASSERT_TRUE(IsOk(set));
  const Photo& first = set->photos[0];
  EXPECT_EQ(first.id, "img-1");
  EXPECT_EQ(first.name, "Img 1");
  // A point 10 mm along table +x and 20 mm up is right of and above the middle: x 8 + 40 * 0.1,
  // y 6 - 40 * 0.2.
  const auto pixel =
      Project(set->intrinsics(first), *first.camera_from_table * Eigen::Vector3d(10, 0, 20));
  ASSERT_TRUE(pixel);
  EXPECT_TRUE(pixel->isApprox(Eigen::Vector2d(12, -2), 1e-12)) << pixel->transpose();
  // After the turn the point (0, -10, 20) of the table stands where (10, 0, 20) stood.
  const auto turned = Project(set->intrinsics(set->photos[1]),
                              *set->photos[1].camera_from_table * Eigen::Vector3d(0, -10, 20));
  EXPECT_TRUE(turned->isApprox(Eigen::Vector2d(12, -2), 1e-12)) << turned->transpose();
  // Both poses are one camera_from_lift seen at two angles.
  ASSERT_EQ(set->aims.size(), 1u);
  ASSERT_TRUE(set->aims[0].camera_from_lift);
  EXPECT_TRUE(set->aims[0].camera_from_lift->translation().isApprox(Eigen::Vector3d(0, 0, 100)));
  EXPECT_DOUBLE_EQ(set->aims[0].sigma.translation_mm, 15);
  EXPECT_DOUBLE_EQ(first.turntable_rad->sigma_view, RadFromDeg(0.1));
  EXPECT_DOUBLE_EQ(first.sigma_view.rotation_rad, RadFromDeg(0.3));
  EXPECT_EQ(set->photos[1].sigma_view.rotation_rad, 0);
}

TEST_F(Import, CopiesPhotographsAndMasksByteForByte) {
  ASSERT_TRUE(IsOk(Run()));
  const auto set = LoadPhotoSet(root() / "out").value();
  EXPECT_EQ(ReadBinaryFile(set.photos[0].path).value(),
            ReadBinaryFile(root() / "photos/Img 1.png").value());
  EXPECT_EQ(set.photos[0].mask_path, root() / "out/derived/masks/img-1_c0.png");
  EXPECT_EQ(ReadBinaryFile(set.photos[0].mask_path).value(),
            ReadBinaryFile(root() / "masks/Img 1.png").value());
  EXPECT_TRUE(VerifySession(root() / "out")->sound());
}

TEST_F(Import, PosesAreOptionalAndIntrinsicsMayBePerFrame) {
  transforms_["frames"][0].erase("transform_matrix");
  transforms_["frames"][0].erase("turntable_deg");
  transforms_["frames"][1]["fl_x"] = 50;
  transforms_["frames"][1]["fl_y"] = 51;
  transforms_["approx_distance_mm"] = 100;
  transforms_["intrinsics_sigma"] = {{"fl_rel", 0.002}, {"c_px", 2}};
  ASSERT_TRUE(IsOk(Run()));
  const auto set = LoadPhotoSet(root() / "out").value();
  EXPECT_FALSE(set.photos[0].camera_from_table);
  EXPECT_FALSE(set.photos[0].turntable_rad);
  EXPECT_TRUE(set.photos[1].camera_from_table);
  ASSERT_EQ(set.lens_states.size(), 2u);
  EXPECT_EQ(set.intrinsics(set.photos[1]).fl_y, 51);
  EXPECT_EQ(set.lens_states[1].sigma.c_px, 2);
  EXPECT_EQ(set.approx_distance_mm, 100);
  EXPECT_NE(set.aims[0].id, set.aims[1].id);
}

TEST_F(Import, ReadsMasksAndIgnoredAreasFromFolders) {
  for (auto& frame : transforms_["frames"]) frame.erase("mask_path");
  request_.masks = root() / "masks";
  request_.ignore = root() / "ignore";
  fs::create_directories(request_.ignore);
  fs::copy(root() / "masks/img_2.png", request_.ignore / "img_2.png");
  ASSERT_TRUE(IsOk(Run()));
  const auto set = LoadPhotoSet(root() / "out").value();
  EXPECT_FALSE(set.photos[0].mask_path.empty());
  EXPECT_TRUE(set.photos[0].ignore_path.empty());
  EXPECT_FALSE(set.photos[1].ignore_path.empty());
}

TEST_F(Import, BadInputIsRefusedWhole) {
  const json good = transforms_;
  const auto refused = [&](const std::function<void(json&)>& damage, const std::string& where) {
    transforms_ = good;
    damage(transforms_);
    ExpectRefused(where);
  };
  refused([](json& t) { t["frames"] = json::array(); }, "frames");
  refused([](json& t) { t.erase("fl_x"); }, "fl_x");
  refused([](json& t) { t["w"] = 17; }, "frames[0].file_path");
  refused([](json& t) { t["camera_model"] = "OPENCV_FISHEYE"; }, "camera_model");
  refused([](json& t) { t["frames"][1]["file_path"] = "none.png"; }, "frames[1].file_path");
  refused([](json& t) { t["frames"][1]["mask_path"] = "none.png"; }, "frames[1].mask_path");
  refused([](json& t) { t["frames"][1]["transform_matrix"][0][0] = 5; },
          "frames[1].transform_matrix");
  refused([](json& t) { t["frames"][1]["prior_sigma"]["rotation_deg"] = 9; }, "img_2.png");
  refused([](json& t) { t["frames"][1] = t["frames"][0]; }, "Img 1.png");
  transforms_ = good;
  const cv::Mat small(5, 5, CV_8U, cv::Scalar(255));
  cv::imwrite((root() / "masks/img_2.png").string(), small);
  ExpectRefused("masks/img_2.png");
  fs::resize_file(root() / "photos/img_2.png", 60);
  ExpectRefused("img_2.png");
}

TEST_F(Import, OverwritesOnlyASessionAndOnlyWhenForced) {
  ASSERT_TRUE(IsOk(Run()));
  EXPECT_EQ(Run().error().kind, ErrorKind::bad_input);
  request_.force = true;
  transforms_["frames"].erase(1);
  ASSERT_TRUE(IsOk(Run()));
  EXPECT_EQ(LoadPhotoSet(root() / "out")->photos.size(), 1u);
  fs::remove_all(root() / "out");
  fs::create_directories(root() / "out");
  WriteText(root() / "out/thesis.txt", "mine");
  EXPECT_EQ(Run().error().kind, ErrorKind::bad_input);
  EXPECT_TRUE(fs::exists(root() / "out/thesis.txt"));
}

TEST_F(Import, ReadsColmapText) {
  request_.transforms.clear();
  request_.photos = root() / "photos";
  request_.colmap = root();
  WriteText(root() / "cameras.txt", "# cameras\n1 SIMPLE_RADIAL 16 12 40 8 6 0.01\n");
  // 90 degrees about x: the world's y goes to the camera's z.
  WriteText(root() / "images.txt",
            "# images\n1 0.7071067811865476 0.7071067811865476 0 0 1 2 3 1 Img 1.png\n\n"
            "2 1 0 0 0 0 0 9 1 img_2.png\n1.5 2.5 -1\n");
  ASSERT_TRUE(IsOk(Run()));
  const auto set = LoadPhotoSet(root() / "out").value();
  ASSERT_EQ(set.photos.size(), 2u);
  EXPECT_EQ(set.intrinsics(set.photos[0]).fl_y, 40);
  EXPECT_EQ(set.intrinsics(set.photos[0]).k1, 0.01);
  const Eigen::Vector3d moved = *set.photos[0].camera_from_table * Eigen::Vector3d(0, 10, 0);
  EXPECT_TRUE(moved.isApprox(Eigen::Vector3d(1, 2, 13), 1e-9)) << moved.transpose();
  fs::remove_all(root() / "out");
  WriteText(root() / "images.txt", "1 1 0 0 0 1 2 3 7 Img 1.png\n\n");
  ExpectRefused("images.txt line 1");
}

TEST_F(Import, PhotographsAloneNeedAFocalLength) {
  request_.transforms.clear();
  request_.photos = root() / "photos";
  ExpectRefused("Img 1.png");
  request_.photos = root() / "empty";
  fs::create_directories(request_.photos);
  ExpectRefused("empty");
}

TEST_F(Import, FocalLengthFromExif) {
  // A JPEG with an APP1 segment: ExifIFD with FocalLengthIn35mmFilm = 50.
  std::vector<unsigned char> jpeg;
  cv::imencode(".jpg", cv::Mat(12, 16, CV_8UC3, cv::Scalar(9, 9, 9)), jpeg);
  const unsigned char app1[] = {0xff, 0xe1, 0, 52, 'E', 'x', 'i',  'f',  0, 0, 'M',  'M',  0, 42,
                                0,    0,    0, 8,  0,   1,   0x87, 0x69, 0, 4, 0,    0,    0, 1,
                                0,    0,    0, 26, 0,   0,   0,    0,    0, 1, 0xa4, 0x05, 0, 3,
                                0,    0,    0, 1,  0,   50,  0,    0,    0, 0, 0,    0};
  static_assert(sizeof(app1) == 54);
  jpeg.insert(jpeg.begin() + 2, std::begin(app1), std::end(app1));
  request_.transforms.clear();
  request_.photos = root() / "jpeg";
  fs::create_directories(request_.photos);
  ASSERT_TRUE(WriteFileDurably(request_.photos / "a.JPG", std::as_bytes(std::span(jpeg))));
  ASSERT_TRUE(IsOk(Run()));
  const auto set = LoadPhotoSet(root() / "out").value();
  EXPECT_NEAR(set.lens_states[0].intrinsics.fl_x, 50 * 20 / std::hypot(36, 24), 1e-6);
  EXPECT_EQ(set.lens_states[0].sigma.fl_rel, 0.1);
  EXPECT_EQ(set.photos[0].path.filename(), "a_c0.jpg");
}

TEST_F(Import, NoMutationOfTheTransformsCrashes) {
  const std::string good = transforms_.dump(1);
  Rng rng(2);
  for (int round = 0; round < 120; ++round) {
    std::string text = good;
    for (std::uint64_t edits = 1 + rng.Below(2); edits > 0; --edits) {
      const std::size_t at = rng.Below(text.size());
      if (rng.Below(2) == 0)
        text[at] = static_cast<char>(rng.Below(256));
      else
        text.erase(at, 1 + rng.Below(30));
    }
    WriteText(request_.transforms, text);
    fs::remove_all(root() / "out");
    const auto report = ImportPhotographs(request_);
    if (!report)
      EXPECT_EQ(report.error().kind, ErrorKind::bad_input) << ToString(report.error());
    else
      EXPECT_TRUE(IsOk(LoadPhotoSet(root() / "out")));
  }
}

TEST(ImportReal, SquirrelOnATurntable) {
  const fs::path data = fs::path(SCAN_SOURCE_DIR) / "../shared/data/squirrel_turntable";
  if (!fs::exists(data / "transforms.json")) GTEST_SKIP() << "no shared data here";
  const TempFolder temp;
  ImportRequest request;
  request.transforms = data / "transforms.json";
  request.out = temp.path() / "squirrel";
  const auto report = ImportPhotographs(request);
  ASSERT_TRUE(IsOk(report));
  EXPECT_EQ(report->photographs, 18);
  EXPECT_EQ(report->with_mask, 18);
  const auto set = LoadPhotoSet(request.out);
  ASSERT_TRUE(IsOk(set));
  ASSERT_EQ(set->lens_states.size(), 1u);
  EXPECT_EQ(set->lens_states[0].sigma.c_px, 4);
  EXPECT_EQ(set->approx_distance_mm, 590);
  // The logged angles explain the nominal poses: one camera_from_lift.
  ASSERT_EQ(set->aims.size(), 1u);
  EXPECT_TRUE(set->aims[0].camera_from_lift);
  for (const auto& photo : set->photos) {
    ASSERT_TRUE(photo.camera_from_table);
    const auto& in = set->intrinsics(photo);
    const auto origin = Project(in, photo.camera_from_table->translation());
    ASSERT_TRUE(origin);
    EXPECT_TRUE(origin->x() > 0 && origin->x() < in.w && origin->y() > 0 && origin->y() < in.h);
    const auto above = Project(in, *photo.camera_from_table * Eigen::Vector3d(0, 0, 50));
    EXPECT_LT(above->y(), origin->y());  // the table's up is up in the picture
  }
}

}  // namespace
}  // namespace scan
