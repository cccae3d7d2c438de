#include "reconstruction/export/glb.h"

#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "drivers/base/files.h"
#include "drivers/base/units.h"
#include "tests/support/meshes.h"
#include "tests/support/temp_folder.h"

namespace scan {
namespace {

// A box whose faces all stand alone, each with its own part of the picture.
AtlasMesh BoxAtlas() {
  const TriangleMesh box = meshes::Box({1, 2, 3}, {2, 4, 6});
  AtlasMesh atlas;
  for (std::uint32_t f = 0; f < box.faces.size(); ++f) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      atlas.mesh.vertices.push_back(box.vertices[box.faces[f][k]]);
      atlas.source_vertex.push_back(box.faces[f][k]);
      atlas.uv.emplace_back((f + 0.5 * (k == 1)) / 12.0, 0.25 + 0.5 * (k == 2));
    }
    atlas.mesh.faces.push_back({3 * f, 3 * f + 1, 3 * f + 2});
    atlas.chart.push_back(f);
  }
  return atlas;
}

// Odd sizes, so that nothing is aligned by chance.
cv::Mat Picture() {
  cv::Mat picture(7, 13, CV_8UC3);
  for (int y = 0; y < 7; ++y)
    for (int x = 0; x < 13; ++x) picture.at<cv::Vec3b>(y, x) = cv::Vec3b(10 * x, 20 * y, 7);
  return picture;
}

class Glb : public ::testing::Test {
 protected:
  std::filesystem::path path() const { return folder_.path() / "model.glb"; }

  // The two chunks, taken apart by hand.
  void Split(nlohmann::json& json, std::string& binary) {
    const std::string bytes = *ReadTextFile(path());
    const auto word = [&](std::size_t at) {
      std::uint32_t value = 0;
      std::memcpy(&value, bytes.data() + at, 4);
      return value;
    };
    ASSERT_GE(bytes.size(), 20u);
    EXPECT_EQ(bytes.substr(0, 4), "glTF");
    EXPECT_EQ(word(4), 2u);
    EXPECT_EQ(word(8), bytes.size());
    const std::uint32_t json_size = word(12);
    EXPECT_EQ(json_size % 4, 0u);
    EXPECT_EQ(bytes.substr(16, 4), "JSON");
    json = nlohmann::json::parse(bytes.substr(20, json_size));
    const std::size_t next = 20 + json_size;
    const std::uint32_t binary_size = word(next);
    EXPECT_EQ(binary_size % 4, 0u);
    EXPECT_EQ(bytes.substr(next + 4, 4), std::string("BIN\0", 4));
    EXPECT_EQ(next + 8 + binary_size, bytes.size());
    binary = bytes.substr(next + 8);
  }

  tinygltf::Model Load() {
    tinygltf::Model model;
    std::string error, warning;
    tinygltf::TinyGLTF reader;
    EXPECT_TRUE(reader.LoadBinaryFromFile(&model, &error, &warning, path().string())) << error;
    EXPECT_EQ(error, "");
    EXPECT_EQ(warning, "");
    return model;
  }

  TempFolder folder_;
};

TEST_F(Glb, IsReadBackByTinygltf) {
  const AtlasMesh atlas = BoxAtlas();
  ASSERT_TRUE(WriteGlb(path(), atlas, Picture()));
  const tinygltf::Model model = Load();
  ASSERT_EQ(model.meshes.size(), 1u);
  const auto& primitive = model.meshes[0].primitives[0];
  const auto& positions =
      model.accessors[static_cast<std::size_t>(primitive.attributes.at("POSITION"))];
  EXPECT_EQ(positions.count, 36u);
  EXPECT_EQ(positions.minValues, (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(positions.maxValues, (std::vector<double>{2, 4, 6}));
  ASSERT_EQ(model.images.size(), 1u);
  EXPECT_EQ(model.images[0].width, 13);
  EXPECT_EQ(model.images[0].height, 7);
  // tinygltf decodes to RGB(A).
  const int channels = model.images[0].component;
  for (int y = 0; y < 7; ++y)
    for (int x = 0; x < 13; ++x) {
      const unsigned char* pixel =
          model.images[0].image.data() + static_cast<std::ptrdiff_t>(channels * (13 * y + x));
      EXPECT_EQ(pixel[0], 7);
      EXPECT_EQ(pixel[1], 20 * y);
      EXPECT_EQ(pixel[2], 10 * x);
    }
  EXPECT_EQ(model.materials[0].pbrMetallicRoughness.metallicFactor, 0);
  EXPECT_EQ(model.materials[0].pbrMetallicRoughness.roughnessFactor, 1);
  EXPECT_TRUE(model.extensionsUsed.empty());
}

TEST_F(Glb, BinaryLayoutIsAligned) {
  const AtlasMesh atlas = BoxAtlas();
  ASSERT_TRUE(WriteGlb(path(), atlas, Picture()));
  nlohmann::json json;
  std::string binary;
  ASSERT_NO_FATAL_FAILURE(Split(json, binary));
  EXPECT_EQ(json["buffers"][0]["byteLength"], binary.size());
  EXPECT_FALSE(json["buffers"][0].contains("uri"));
  std::size_t end = 0;
  for (const auto& view : json["bufferViews"]) {
    const std::size_t offset = view.value("byteOffset", 0u);
    EXPECT_EQ(offset % 4, 0u);
    EXPECT_GE(offset, end);
    end = offset + view["byteLength"].get<std::size_t>();
    EXPECT_LE(end, binary.size());
  }
  const auto& primitive = json["meshes"][0]["primitives"][0];
  const auto read = [&](int accessor_id, int components, auto type) {
    using T = decltype(type);
    const auto& accessor = json["accessors"][accessor_id];
    const auto& view = json["bufferViews"][accessor["bufferView"].get<int>()];
    std::vector<T> values(accessor["count"].get<std::size_t>() *
                          static_cast<std::size_t>(components));
    EXPECT_EQ(view["byteLength"], values.size() * sizeof(T));
    std::memcpy(values.data(), binary.data() + view.value("byteOffset", 0u),
                values.size() * sizeof(T));
    return values;
  };
  const auto positions = read(primitive["attributes"]["POSITION"], 3, float{});
  const auto normals = read(primitive["attributes"]["NORMAL"], 3, float{});
  const auto uvs = read(primitive["attributes"]["TEXCOORD_0"], 2, float{});
  const auto indices = read(primitive["indices"], 1, std::uint32_t{});
  EXPECT_EQ(json["accessors"][primitive["indices"].get<int>()]["componentType"], 5125);
  ASSERT_EQ(indices.size(), 36u);
  for (std::size_t v = 0; v < 36; ++v) {
    EXPECT_EQ(indices[v], v);
    const auto at = static_cast<Eigen::Index>(v);
    const Eigen::Vector3f p = Eigen::Map<const Eigen::Matrix3Xf>(positions.data(), 3, 36).col(at);
    const Eigen::Vector3f n = Eigen::Map<const Eigen::Matrix3Xf>(normals.data(), 3, 36).col(at);
    EXPECT_EQ(p, atlas.mesh.vertices[v].cast<float>());
    EXPECT_NEAR(n.norm(), 1, 1e-6);
    EXPECT_GT(n.dot(p - Eigen::Vector3f(1.5f, 3, 4.5f)), 0);
    EXPECT_FLOAT_EQ(uvs[2 * v], static_cast<float>(atlas.uv[v].x()));
    EXPECT_FLOAT_EQ(uvs[2 * v + 1], static_cast<float>(atlas.uv[v].y()));
    // No crease along seams: equal points have equal normals.
    for (std::size_t w = 0; w < v; ++w) {
      if (atlas.source_vertex[w] != atlas.source_vertex[v]) continue;
      EXPECT_EQ(std::memcmp(&normals[3 * v], &normals[3 * w], 12), 0);
    }
  }
  // The picture lies in the buffer as its own file.
  const auto& view = json["bufferViews"][json["images"][0]["bufferView"].get<int>()];
  const std::string png = binary.substr(view["byteOffset"], view["byteLength"]);
  EXPECT_EQ(png.substr(1, 3), "PNG");
  EXPECT_FALSE(view.contains("target"));
}

TEST_F(Glb, RootNodeTurnsTheTableUpright) {
  const TableFromModel table_from_model(
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix(), {4, 5, 6});
  for (const bool known : {false, true}) {
    GlbOptions options;
    if (known) options.table_from_model = table_from_model;
    ASSERT_TRUE(WriteGlb(path(), BoxAtlas(), Picture(), options));
    const tinygltf::Model model = Load();
    const auto& node = model.nodes[static_cast<std::size_t>(model.scenes[0].nodes[0])];
    const Eigen::Quaterniond q(node.rotation[3], node.rotation[0], node.rotation[1],
                               node.rotation[2]);
    const Eigen::Vector3d scale(node.scale[0], node.scale[1], node.scale[2]);
    const Eigen::Vector3d shift(node.translation[0], node.translation[1], node.translation[2]);
    const Eigen::Vector3d in_model(7, -8, 9);
    const Eigen::Vector3d in_table = known ? table_from_model * in_model : in_model;
    const Eigen::Vector3d expected(in_table.x(), in_table.z(), -in_table.y());
    EXPECT_NEAR((q * scale.cwiseProduct(in_model) + shift - 0.001 * expected).norm(), 0, 1e-12);
  }
}

TEST_F(Glb, CarriesMetadataAndUnlit) {
  GlbOptions options;
  options.unlit = true;
  options.copyright = "CC0";
  options.metadata = {{"dwc:catalogNumber", "A 1"}, {"note", "\"quoted\" \xc3\xa4"}};
  SCOPED_TRACE("unlit");
  ASSERT_TRUE(WriteGlb(path(), BoxAtlas(), Picture(), options));
  nlohmann::json json;
  std::string binary;
  ASSERT_NO_FATAL_FAILURE(Split(json, binary));
  EXPECT_EQ(json["asset"]["version"], "2.0");
  EXPECT_EQ(json["asset"]["copyright"], "CC0");
  EXPECT_EQ(json["asset"]["extras"]["dwc:catalogNumber"], "A 1");
  EXPECT_EQ(json["asset"]["extras"]["note"], "\"quoted\" \xc3\xa4");
  EXPECT_EQ(json["extensionsUsed"][0], "KHR_materials_unlit");
  EXPECT_TRUE(json["materials"][0]["extensions"].contains("KHR_materials_unlit"));
}

TEST_F(Glb, EmbedsJpeg) {
  const auto jpeg = EncodeJpeg(Picture(), 90);
  ASSERT_TRUE(jpeg);
  ASSERT_TRUE(WriteGlb(path(), BoxAtlas(), *jpeg));
  EXPECT_EQ(Load().images[0].mimeType, "image/jpeg");
}

TEST_F(Glb, SameInputSameBytes) {
  ASSERT_TRUE(WriteGlb(path(), BoxAtlas(), Picture()));
  const std::string first = *ReadTextFile(path());
  ASSERT_TRUE(WriteGlb(path(), BoxAtlas(), Picture()));
  EXPECT_EQ(first, *ReadTextFile(path()));
}

TEST_F(Glb, BadInputIsRefusedAndNothingWritten) {
  const auto expect_bad = [&](const AtlasMesh& atlas, const cv::Mat& picture,
                              const GlbOptions& options = {}) {
    const auto written = WriteGlb(path(), atlas, picture, options);
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().kind, ErrorKind::bad_input);
    EXPECT_FALSE(std::filesystem::exists(path()));
  };
  expect_bad({}, Picture());
  expect_bad(BoxAtlas(), {});
  expect_bad(BoxAtlas(), cv::Mat(4, 4, CV_32F, cv::Scalar(1)));
  AtlasMesh atlas = BoxAtlas();
  atlas.mesh.vertices[3].x() = std::numeric_limits<double>::quiet_NaN();
  expect_bad(atlas, Picture());
  atlas = BoxAtlas();
  atlas.uv.pop_back();
  expect_bad(atlas, Picture());
  atlas = BoxAtlas();
  atlas.mesh.faces[0][0] = 99;
  expect_bad(atlas, Picture());
  GlbOptions options;
  options.name = "\xff\xfe";
  expect_bad(BoxAtlas(), Picture(), options);
  const auto failed = WriteGlb(folder_.path() / "absent/model.glb", BoxAtlas(), Picture());
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().kind, ErrorKind::failed);
}

}  // namespace
}  // namespace scan
