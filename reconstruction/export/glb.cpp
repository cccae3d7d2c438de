#include "reconstruction/export/glb.h"

#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "drivers/base/files.h"
#include "drivers/base/units.h"

namespace scan {
namespace {

constexpr double kMetresPerMm = 0.001;

Result<EncodedPicture> Encode(const cv::Mat& bgr, const char* extension, const char* mime_type,
                              const std::vector<int>& parameters) {
  if (bgr.empty() || (bgr.type() != CV_8UC3 && bgr.type() != CV_8UC1))
    return BadInput("texture is empty or not 8-bit colour", "model.glb", "give an 8-bit picture");
  EncodedPicture picture;
  picture.mime_type = mime_type;
  try {
    if (cv::imencode(extension, bgr, picture.bytes, parameters)) return picture;
  } catch (const cv::Exception&) {
  }
  return Failed("the texture cannot be encoded", "model.glb", "choose a smaller texture");
}

// Appends blocks of the binary chunk, each at a multiple of four bytes, with a view for each.
class BufferBuilder {
 public:
  explicit BufferBuilder(tinygltf::Model& model) : model_(model) { model_.buffers.emplace_back(); }

  template <class T>
  int Append(const std::vector<T>& values, int target) {
    std::vector<unsigned char>& data = model_.buffers[0].data;
    data.resize((data.size() + 3) / 4 * 4, 0);
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = data.size();
    view.byteLength = values.size() * sizeof(T);
    view.target = target;
    data.resize(data.size() + view.byteLength);
    std::memcpy(data.data() + view.byteOffset, values.data(), view.byteLength);
    model_.bufferViews.push_back(view);
    return static_cast<int>(model_.bufferViews.size()) - 1;
  }

  void PadToEnd() {
    std::vector<unsigned char>& data = model_.buffers[0].data;
    data.resize((data.size() + 3) / 4 * 4, 0);
  }

 private:
  tinygltf::Model& model_;
};

int AddAccessor(tinygltf::Model& model, int view, int component, int type, std::size_t count) {
  tinygltf::Accessor accessor;
  accessor.bufferView = view;
  accessor.componentType = component;
  accessor.type = type;
  accessor.count = count;
  model.accessors.push_back(accessor);
  return static_cast<int>(model.accessors.size()) - 1;
}

// Per vertex of the atlas, of the unsplit surface: no crease along seams.
std::vector<float> SmoothNormals(const AtlasMesh& atlas) {
  TriangleMesh joined;
  std::uint32_t points = 0;
  for (const std::uint32_t id : atlas.source_vertex) points = std::max(points, id + 1);
  joined.vertices.assign(points, Eigen::Vector3d::Zero());
  for (std::size_t v = 0; v < atlas.source_vertex.size(); ++v)
    joined.vertices[atlas.source_vertex[v]] = atlas.mesh.vertices[v];
  for (const Face& f : atlas.mesh.faces)
    joined.faces.push_back(
        {atlas.source_vertex[f[0]], atlas.source_vertex[f[1]], atlas.source_vertex[f[2]]});
  const auto normals = VertexNormals(joined);
  std::vector<float> values;
  for (const std::uint32_t id : atlas.source_vertex) {
    // glTF wants unit length even where there is no direction.
    const Eigen::Vector3d n = normals[id].isZero() ? Eigen::Vector3d::UnitZ() : normals[id];
    for (int axis = 0; axis < 3; ++axis) values.push_back(static_cast<float>(n[axis]));
  }
  return values;
}

tinygltf::Primitive AddGeometry(tinygltf::Model& model, BufferBuilder& buffer,
                                const AtlasMesh& atlas) {
  std::vector<float> positions, uvs;
  std::vector<double> low(3, HUGE_VAL), high(3, -HUGE_VAL);
  for (const Eigen::Vector3d& v : atlas.mesh.vertices)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float value = static_cast<float>(v[static_cast<Eigen::Index>(axis)]);
      positions.push_back(value);
      low[axis] = std::min(low[axis], static_cast<double>(value));
      high[axis] = std::max(high[axis], static_cast<double>(value));
    }
  for (const Eigen::Vector2d& uv : atlas.uv) {
    uvs.push_back(static_cast<float>(uv.x()));
    uvs.push_back(static_cast<float>(uv.y()));
  }
  std::vector<std::uint32_t> indices;
  for (const Face& f : atlas.mesh.faces) indices.insert(indices.end(), f.begin(), f.end());

  const std::size_t vertices = atlas.mesh.vertices.size();
  const int position = AddAccessor(model, buffer.Append(positions, TINYGLTF_TARGET_ARRAY_BUFFER),
                                   TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3, vertices);
  model.accessors[static_cast<std::size_t>(position)].minValues = low;
  model.accessors[static_cast<std::size_t>(position)].maxValues = high;
  tinygltf::Primitive primitive;
  primitive.mode = TINYGLTF_MODE_TRIANGLES;
  primitive.attributes["POSITION"] = position;
  primitive.attributes["NORMAL"] =
      AddAccessor(model, buffer.Append(SmoothNormals(atlas), TINYGLTF_TARGET_ARRAY_BUFFER),
                  TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3, vertices);
  primitive.attributes["TEXCOORD_0"] =
      AddAccessor(model, buffer.Append(uvs, TINYGLTF_TARGET_ARRAY_BUFFER),
                  TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC2, vertices);
  primitive.indices =
      AddAccessor(model, buffer.Append(indices, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER),
                  TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, TINYGLTF_TYPE_SCALAR, indices.size());
  return primitive;
}

int AddMaterial(tinygltf::Model& model, BufferBuilder& buffer, const EncodedPicture& albedo,
                bool unlit) {
  tinygltf::Image image;
  image.name = "albedo";
  image.mimeType = albedo.mime_type;
  image.bufferView = buffer.Append(albedo.bytes, 0);
  model.images.push_back(image);
  tinygltf::Sampler sampler;
  sampler.minFilter = TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_LINEAR;
  sampler.magFilter = TINYGLTF_TEXTURE_FILTER_LINEAR;
  sampler.wrapS = sampler.wrapT = TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
  model.samplers.push_back(sampler);
  tinygltf::Texture texture;
  texture.sampler = texture.source = 0;
  model.textures.push_back(texture);
  tinygltf::Material material;
  material.name = "albedo";
  material.doubleSided = true;
  material.pbrMetallicRoughness.baseColorTexture.index = 0;
  material.pbrMetallicRoughness.metallicFactor = 0;
  material.pbrMetallicRoughness.roughnessFactor = 1;
  if (unlit) {
    material.extensions["KHR_materials_unlit"] = tinygltf::Value(tinygltf::Value::Object());
    model.extensionsUsed.push_back("KHR_materials_unlit");
  }
  model.materials.push_back(material);
  return 0;
}

// Model mm to glTF's metres with +Y up.
tinygltf::Node RootNode(const GlbOptions& options) {
  const TableFromModel table_from_model = options.table_from_model.value_or(TableFromModel());
  const Eigen::AngleAxisd y_up(-kPi / 2, Eigen::Vector3d::UnitX());  // +z to +Y
  const Eigen::Quaterniond turn(y_up.toRotationMatrix() * table_from_model.rotation());
  const Eigen::Vector3d shift = kMetresPerMm * (y_up * table_from_model.translation());
  tinygltf::Node node;
  node.name = options.name;
  node.mesh = 0;
  const Eigen::Quaterniond q = turn.normalized();
  node.rotation = {q.x(), q.y(), q.z(), q.w()};
  node.translation = {shift.x(), shift.y(), shift.z()};
  node.scale = {kMetresPerMm, kMetresPerMm, kMetresPerMm};
  return node;
}

tinygltf::Asset MakeAsset(const GlbOptions& options) {
  tinygltf::Asset asset;
  asset.version = "2.0";
  asset.generator = "scanstation";
  asset.copyright = options.copyright;
  if (!options.metadata.empty()) {
    tinygltf::Value::Object extras;
    for (const auto& [key, value] : options.metadata) extras[key] = tinygltf::Value(value);
    asset.extras = tinygltf::Value(extras);
  }
  return asset;
}

Status CheckInput(const std::string& where, const AtlasMesh& atlas, const EncodedPicture& albedo) {
  if (atlas.mesh.faces.empty())
    return BadInput("model has no faces", where, "give an atlas with faces");
  if (atlas.uv.size() != atlas.mesh.vertices.size() ||
      atlas.source_vertex.size() != atlas.mesh.vertices.size())
    return BadInput("atlas and mesh differ in their number of vertices", where,
                    "make the atlas again");
  for (std::size_t v = 0; v < atlas.uv.size(); ++v)
    if (!atlas.mesh.vertices[v].allFinite() || !atlas.uv[v].allFinite())
      return BadInput("a vertex is NaN or infinite", where, "repair the mesh");
  for (const Face& face : atlas.mesh.faces)
    for (const std::uint32_t v : face)
      if (v >= atlas.uv.size()) return BadInput("a face names no vertex", where, "repair the mesh");
  if (albedo.bytes.empty() || (albedo.mime_type != "image/png" && albedo.mime_type != "image/jpeg"))
    return BadInput("texture is neither PNG nor JPEG", where, "encode it as PNG");
  const double bytes = 32.0 * static_cast<double>(atlas.uv.size()) +
                       12.0 * static_cast<double>(atlas.mesh.faces.size()) +
                       static_cast<double>(albedo.bytes.size());
  if (bytes > 4.0e9)
    return BadInput("model is larger than the 4 GB of a GLB", where, "decimate the mesh");
  return {};
}

}  // namespace

Result<EncodedPicture> EncodePng(const cv::Mat& bgr) {
  return Encode(bgr, ".png", "image/png", {});
}

Result<EncodedPicture> EncodeJpeg(const cv::Mat& bgr, int quality) {
  return Encode(bgr, ".jpg", "image/jpeg", {cv::IMWRITE_JPEG_QUALITY, quality});
}

Status WriteGlb(const std::filesystem::path& path, const AtlasMesh& atlas,
                const EncodedPicture& albedo, const GlbOptions& options) {
  SCAN_CHECK(CheckInput(path.string(), atlas, albedo));
  tinygltf::Model model;
  model.asset = MakeAsset(options);
  BufferBuilder buffer(model);
  tinygltf::Mesh mesh;
  mesh.name = options.name;
  mesh.primitives.push_back(AddGeometry(model, buffer, atlas));
  mesh.primitives[0].material = AddMaterial(model, buffer, albedo, options.unlit);
  buffer.PadToEnd();
  model.meshes.push_back(mesh);
  model.nodes.push_back(RootNode(options));
  tinygltf::Scene scene;
  scene.nodes = {0};
  model.scenes.push_back(scene);
  model.defaultScene = 0;

  std::ostringstream stream;
  try {
    tinygltf::TinyGLTF writer;
    if (!writer.WriteGltfSceneToStream(&model, stream, false, true))
      return Failed("the model cannot be written as glTF", path.string(), "decimate the mesh");
  } catch (const std::exception& error) {  // text that is not UTF-8
    return BadInput(std::string("the model cannot be written as glTF (") + error.what() + ")",
                    path.string(), "use UTF-8 in names and metadata");
  }
  return WriteFileDurably(path, stream.str());
}

Status WriteGlb(const std::filesystem::path& path, const AtlasMesh& atlas,
                const cv::Mat& albedo_bgr, const GlbOptions& options) {
  SCAN_TRY(const EncodedPicture albedo, EncodePng(albedo_bgr));
  return WriteGlb(path, atlas, albedo, options);
}

}  // namespace scan
