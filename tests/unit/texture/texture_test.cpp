#include "reconstruction/texture/texture.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "reconstruction/atlas/atlas.h"
#include "reconstruction/atlas/texel_map.h"
#include "reconstruction/specimens/photograph.h"
#include "tests/support/temp_folder.h"

namespace scan {
namespace {

// A large ball with a smooth pattern and a small red one that hides part of it from some cameras.
class TwoBalls final : public Specimen {
 public:
  std::string_view name() const override { return "two-balls"; }
  double SignedDistance(const Eigen::Vector3d& p) const override {
    return std::min(p.norm() - 8, (p - small_centre).norm() - 2.5);
  }
  Eigen::Vector3d Albedo(const Eigen::Vector3d& p) const override {
    if ((p - small_centre).norm() < 2.8) return {0.8, 0.02, 0.02};
    return {0.1, 0.35 + 0.2 * std::sin(0.5 * p.x()) * std::cos(0.5 * p.z()),
            0.4 + 0.2 * std::sin(0.6 * p.y())};
  }
  double Density(const Eigen::Vector3d&) const override { return 1; }
  BoundingBox Bounds() const override {
    return {Eigen::Vector3d(-8.5, -8.5, -8.5), Eigen::Vector3d(15, 8.5, 8.5)};
  }
  Eigen::Vector3d small_centre{12, 0, 0};
};

CameraFromModel CameraAround(double azimuth_rad, double elevation_rad, double distance_mm) {
  const Eigen::Vector3d centre =
      distance_mm * Eigen::Vector3d(std::cos(azimuth_rad) * std::cos(elevation_rad),
                                    std::sin(azimuth_rad) * std::cos(elevation_rad),
                                    std::sin(elevation_rad));
  const Eigen::Vector3d forward = -centre.normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d rotation;
  rotation.row(0) = right;
  rotation.row(1) = forward.cross(right);
  rotation.row(2) = forward;
  return CameraFromModel(rotation, -rotation * centre);
}

class Texture : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { rig_ = new Rig; }
  static void TearDownTestSuite() {
    delete rig_;
    rig_ = nullptr;
  }

  struct Rig {
    Rig() : specimen(std::make_shared<TwoBalls>()) {
      PhotographOptions options;
      options.edge_mm = 0.4;
      options.shading = 0;
      options.vignetting = 0;
      const PhotographScene scene = MakePhotographScene(specimen, options);
      AtlasOptions atlas_options;
      atlas_options.size_px = kSize;
      atlas = MakeAtlas(ExactSurface(*specimen, 0.5), atlas_options).value().atlas;
      Intrinsics in{.w = 300, .h = 260, .fl_x = 900, .fl_y = 900, .cx = 148, .cy = 131};
      in.k1 = -0.1;
      photos.session = folder.path();
      photos.lens_states.push_back({"l0", in, {}});
      photos.aims.resize(1);
      poses.lens_states["l0"].intrinsics = in;
      for (int i = 0; i < 6; ++i) {
        const CameraFromModel camera = CameraAround(i * M_PI / 3 + 0.1, i % 2 ? 0.5 : -0.2, 120);
        Photo& photo = photos.photos.emplace_back();
        photo.name = "v" + std::to_string(i);
        photo.path = folder.path() / (photo.name + ".png");
        cv::imwrite(photo.path.string(), RenderPhotograph(scene, camera, in));
        Mask& mask = masks.emplace_back();
        mask.coverage = TrueCoverage(scene, camera, in);
        ViewPose& pose = poses.views.emplace_back();
        pose.name = photo.name;
        pose.lens_state = "l0";
        pose.status = ViewStatus::accepted;
        pose.camera_from_model = camera;
      }
    }
    TempFolder folder;
    std::shared_ptr<TwoBalls> specimen;
    AtlasMesh atlas;
    PhotoSet photos;
    Poses poses;
    std::vector<Mask> masks;
  };

  static constexpr int kSize = 384;

  static TextureResult Make(MergeMethod method = MergeMethod::seams) {
    TextureOptions options;
    options.size_px = kSize;
    options.method = method;
    auto result = MakeTexture(rig_->atlas, rig_->photos, rig_->poses, rig_->masks, options);
    EXPECT_TRUE(result) << ToString(result.error());
    return result.value();
  }

  struct ColourErrors {
    double rms_codes = 0, worst_codes = 0, reddest_on_large_ball = 0;
    int measured = 0, filled = 0, none_inside = 0;
  };

  static ColourErrors Compare(const TextureResult& texture) {
    const TexelMap map = MakeTexelMap(rig_->atlas, kSize);
    ColourErrors errors;
    double squares = 0;
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        if (map.kind.at<uchar>(y, x) != static_cast<uchar>(TexelKind::inside)) continue;
        const auto kind = static_cast<TexelClass>(texture.provenance.at<cv::Vec3w>(y, x)[0]);
        errors.none_inside += kind == TexelClass::none;
        errors.filled += kind == TexelClass::filled;
        if (kind != TexelClass::measured && kind != TexelClass::blended) continue;
        ++errors.measured;
        const Eigen::Vector3d p = SurfacePoint(rig_->atlas, map, x, y);
        const Eigen::Vector3d albedo = rig_->specimen->Albedo(p);
        const cv::Vec3b code = texture.albedo.at<cv::Vec3b>(y, x);
        for (int c = 0; c < 3; ++c) {
          const double l = std::clamp(kWhite * albedo[2 - c], 0.0, 1.0);
          const double truth =
              255 * (l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1 / 2.4) - 0.055);
          const double error = code[c] - truth;
          squares += error * error / 3;
          errors.worst_codes = std::max(errors.worst_codes, std::abs(error));
        }
        if (p.norm() < 9) {
          errors.reddest_on_large_ball = std::max<double>(errors.reddest_on_large_ball, code[2]);
        }
      }
    }
    errors.rms_codes = std::sqrt(squares / errors.measured);
    return errors;
  }

  static constexpr double kWhite = 0.9;  // linear value of a white surface at exposure 1
  static Rig* rig_;
};
Texture::Rig* Texture::rig_ = nullptr;

TEST_F(Texture, MeasuredColourIsTheSpecimensOwn) {
  for (const MergeMethod method : {MergeMethod::best_view, MergeMethod::seams}) {
    const TextureResult texture = Make(method);
    if (const char* folder = std::getenv("SCAN_TEST_PICTURES")) {
      cv::imwrite(
          std::string(folder) + "/albedo" + std::to_string(static_cast<int>(method)) + ".png",
          texture.albedo);
      cv::imwrite(std::string(folder) + "/photo.png",
                  cv::imread(rig_->photos.photos[0].path.string()));
    }
    const ColourErrors errors = Compare(texture);
    RecordProperty("rms_codes", std::to_string(errors.rms_codes));
    EXPECT_LT(errors.rms_codes, 3);
    // The large ball's red code is 89 at most; a single mixed pixel of the small one is far above.
    EXPECT_LT(errors.reddest_on_large_ball, 110);
    EXPECT_GT(errors.filled, 50);  // behind and between the balls
    EXPECT_EQ(errors.none_inside, 0);
    EXPECT_GT(texture.report.measured_share, 0.8);
    EXPECT_LT(texture.report.measured_share, 0.999);
  }
}

TEST_F(Texture, ProvenanceNamesThePhotographAndTheIncidence) {
  const TextureResult texture = Make(MergeMethod::best_view);
  const TexelMap map = MakeTexelMap(rig_->atlas, kSize);
  int outside = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const cv::Vec3w p = texture.provenance.at<cv::Vec3w>(y, x);
      if (map.kind.at<uchar>(y, x) != static_cast<uchar>(TexelKind::inside)) {
        ++outside;
        ASSERT_EQ(p, cv::Vec3w(0, kNoView, 0));
        continue;
      }
      if (p[1] == kNoView) {
        ASSERT_EQ(p[0], static_cast<int>(TexelClass::filled));
        continue;
      }
      ASSERT_LT(p[1], 6);
      const Eigen::Vector3d point = SurfacePoint(rig_->atlas, map, x, y);
      if (point.norm() > 8.3) continue;  // the large ball, whose normal is known
      const Eigen::Vector3d ray =
          (CameraCentre(rig_->poses.views[p[1]].camera_from_model) - point).normalized();
      const double incidence_deg = std::acos(point.normalized().dot(ray)) * 180 / M_PI;
      ASSERT_NEAR(p[2] / 100.0, incidence_deg, 5);  // a coarse mesh
    }
  }
  EXPECT_GT(outside, 100);
}

TEST_F(Texture, SameBytesForAnyNumberOfThreads) {
  const TextureResult many = Make();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const TextureResult single = Make();
  EXPECT_EQ(cv::norm(many.albedo, single.albedo, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(many.provenance, single.provenance, cv::NORM_INF), 0);
}

TEST_F(Texture, RejectedViewsGiveNothing) {
  Poses poses = rig_->poses;
  for (std::size_t i = 1; i < poses.views.size(); ++i) poses.views[i].status = ViewStatus::rejected;
  TextureOptions options;
  options.size_px = kSize;
  const auto texture = MakeTexture(rig_->atlas, rig_->photos, poses, rig_->masks, options);
  ASSERT_TRUE(texture);
  EXPECT_GT(texture->report.view_share[0], 0.2);
  EXPECT_LT(texture->report.measured_share, 0.5);
  EXPECT_EQ(texture->report.seam_pairs, 0u);
  poses.views[0].status = ViewStatus::rejected;
  EXPECT_FALSE(MakeTexture(rig_->atlas, rig_->photos, poses, rig_->masks, options));
}

TEST_F(Texture, BadInputIsRefused) {
  TextureOptions options;
  options.size_px = kSize;
  auto refused = [&](const AtlasMesh& atlas, const PhotoSet& photos, std::span<const Mask> masks,
                     const TextureOptions& asked) {
    const auto result = MakeTexture(atlas, photos, rig_->poses, masks, asked);
    return !result && result.error().kind == ErrorKind::bad_input;
  };
  EXPECT_TRUE(refused({}, rig_->photos, rig_->masks, options));
  AtlasMesh atlas = rig_->atlas;
  atlas.uv[0].x() = std::nan("");
  EXPECT_TRUE(refused(atlas, rig_->photos, rig_->masks, options));
  TextureOptions wrong = options;
  wrong.size_px = 0;
  EXPECT_TRUE(refused(rig_->atlas, rig_->photos, rig_->masks, wrong));
  PhotoSet photos = rig_->photos;
  photos.photos[2].path = "/nowhere.png";
  EXPECT_TRUE(refused(rig_->atlas, photos, rig_->masks, options));
  std::vector<Mask> masks = rig_->masks;
  masks[3].coverage = cv::Mat::zeros(4, 4, CV_8U);
  EXPECT_TRUE(refused(rig_->atlas, rig_->photos, masks, options));
  std::stop_source stop;
  stop.request_stop();
  const auto cancelled = MakeTexture(rig_->atlas, rig_->photos, rig_->poses, rig_->masks, options,
                                     {}, stop.get_token());
  ASSERT_FALSE(cancelled);
  EXPECT_EQ(cancelled.error().kind, ErrorKind::cancelled);
}

}  // namespace
}  // namespace scan
