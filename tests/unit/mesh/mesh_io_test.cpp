#include "reconstruction/mesh/mesh_io.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include "drivers/base/files.h"
#include "drivers/base/rng.h"
#include "tests/support/meshes.h"
#include "tests/support/temp_folder.h"

namespace scan {
namespace {

class MeshIo : public ::testing::Test {
 protected:
  Result<TriangleMesh> Read(const std::string& name, const std::string& content) {
    const auto path = folder_.path() / name;
    std::ofstream(path, std::ios::binary) << content;
    return ReadMesh(path);
  }
  void ExpectBad(const std::string& name, const std::string& content) {
    const auto mesh = Read(name, content);
    ASSERT_FALSE(mesh) << content;
    EXPECT_EQ(mesh.error().kind, ErrorKind::bad_input) << content;
    EXPECT_FALSE(mesh.error().what.empty());
    EXPECT_NE(mesh.error().where.find(name), std::string::npos);
    EXPECT_FALSE(mesh.error().mend.empty());
  }
  std::string Bytes(const std::filesystem::path& path) { return *ReadTextFile(path); }

  TempFolder folder_;
};

const char kAsciiTriangle[] =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

template <class T>
void Append(std::string& bytes, T value, bool big) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  if (big) std::reverse(raw, raw + sizeof(T));
  bytes.append(raw, sizeof(T));
}

// Normals, colours, a foreign element, doubles, a quad, a face list that is not the first property.
std::string OddPly(bool big) {
  std::string bytes = std::string("ply\r\nformat binary_") + (big ? "big" : "little") +
                      "_endian 1.0\r\ncomment odd\r\nelement camera 1\r\nproperty float focal\r\n"
                      "property list ushort double params\r\nelement vertex 4\r\n"
                      "property uchar red\r\nproperty double z\r\nproperty double x\r\n"
                      "property double y\r\nelement face 1\r\nproperty short part\r\n"
                      "property list uint ushort vertex_index\r\nproperty float quality\r\n"
                      "end_header\r\n";
  Append(bytes, 2.5f, big);
  Append(bytes, std::uint16_t{2}, big);
  Append(bytes, 1.0, big);
  Append(bytes, 2.0, big);
  for (int i = 0; i < 4; ++i) {
    Append(bytes, std::uint8_t{200}, big);
    for (const double value : {0.5, i == 1 || i == 2 ? 1.0 : 0.0, i >= 2 ? 2.0 : 0.0})
      Append(bytes, value, big);
  }
  Append(bytes, std::int16_t{-7}, big);
  Append(bytes, std::uint32_t{4}, big);
  for (std::uint16_t i = 0; i < 4; ++i) Append(bytes, i, big);
  Append(bytes, 0.25f, big);
  return bytes;
}

TEST_F(MeshIo, PlyComesBackAsWritten) {
  TriangleMesh mesh = meshes::Torus(3, 1, 20, 10);
  for (auto& v : mesh.vertices)
    for (int axis = 0; axis < 3; ++axis)
      v[axis] = std::round(v[axis] * 1024) / 1024;  // exact as float
  ASSERT_TRUE(WritePly(folder_.path() / "m.ply", mesh));
  const auto read = ReadMesh(folder_.path() / "m.ply");
  ASSERT_TRUE(read) << ToString(read.error());
  EXPECT_EQ(read->vertices, mesh.vertices);
  EXPECT_EQ(read->faces, mesh.faces);
}

TEST_F(MeshIo, ReadsAsciiPly) {
  const auto mesh = Read("a.ply", kAsciiTriangle);
  ASSERT_TRUE(mesh) << ToString(mesh.error());
  EXPECT_EQ(mesh->faces.size(), 1u);
  EXPECT_EQ(mesh->vertices[2], Eigen::Vector3d(0, 1, 0));
}

TEST_F(MeshIo, ReadsAnyLayoutInBothByteOrders) {
  for (const bool big : {false, true}) {
    const auto mesh = Read("odd.ply", OddPly(big));
    ASSERT_TRUE(mesh) << ToString(mesh.error());
    ASSERT_EQ(mesh->vertices.size(), 4u);
    EXPECT_EQ(mesh->vertices[2], Eigen::Vector3d(1, 2, 0.5));
    EXPECT_EQ(mesh->faces, (std::vector<Face>{{0, 1, 2}, {0, 2, 3}}));
  }
}

TEST_F(MeshIo, ReadsObjWithNegativeIndicesPolygonsAndContinuedLines) {
  const auto mesh = Read("m.OBJ",
                         "# comment\r\nmtllib x.mtl\r\nv 0 0 0 1 0.5 0.5\r\nv 1 0 0\r\nv 1 1 0\r\n"
                         "v 0 1 0\r\nvn 0 0 1\r\nvt 0 0\r\nf 1//1 2//1 3//1 4//1 # quad\r\n"
                         "f -4/1 \\\r\n -3/1/1 -1\r\n");
  ASSERT_TRUE(mesh) << ToString(mesh.error());
  EXPECT_EQ(mesh->faces, (std::vector<Face>{{0, 1, 2}, {0, 2, 3}, {0, 1, 3}}));
}

TEST_F(MeshIo, MalformedPlyIsBadInput) {
  const std::string good = kAsciiTriangle;
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  ExpectBad("m.ply", "");
  ExpectBad("m.ply", "ply\n");
  ExpectBad("m.ply", "plx\n");
  ExpectBad("m.ply", with("ascii", "utf8"));
  ExpectBad("m.ply", with("format ascii 1.0\n", ""));
  ExpectBad("m.ply", with("property float z\n", ""));
  ExpectBad("m.ply", with("float z", "float x"));
  ExpectBad("m.ply", with("float z", "quux z"));
  ExpectBad("m.ply", with("vertex 3", "vertex -3"));
  ExpectBad("m.ply", with("vertex 3", "vertex 18446744073709551615"));
  ExpectBad("m.ply", with("vertex 3", "vertex 4000000000"));
  ExpectBad("m.ply", with("face 1", "face 18446744073709551615"));
  ExpectBad("m.ply", with("face 1", "face 0"));
  ExpectBad("m.ply", with("face 1", "edge 1"));
  ExpectBad("m.ply", with("end_header", "endheader"));
  ExpectBad("m.ply", with("0 1 0", "0 nan 0"));
  ExpectBad("m.ply", with("0 1 0", "0 inf 0"));
  ExpectBad("m.ply", with("0 1 0", "0 x 0"));
  ExpectBad("m.ply", with("3 0 1 2", "3 0 1 3"));
  ExpectBad("m.ply", with("3 0 1 2", "3 0 1 -1"));
  ExpectBad("m.ply", with("3 0 1 2", "3 0 1 1.5"));
  ExpectBad("m.ply", with("3 0 1 2", "3 0 1"));
  ExpectBad("m.ply", with("3 0 1 2", "2 0 1"));
  ExpectBad("m.ply", with("3 0 1 2", "-3 0 1 2"));
  ExpectBad("m.ply", with("3 0 1 2", "1e300 0 1 2"));
  ExpectBad("m.ply", with("3 0 1 2", "nan 0 1 2"));
}

TEST_F(MeshIo, MalformedObjIsBadInput) {
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  ExpectBad("m.obj", "");
  ExpectBad("m.obj", vertices);
  ExpectBad("m.obj", vertices + "f 1 2\n");
  ExpectBad("m.obj", vertices + "f 1 2 4\n");
  ExpectBad("m.obj", vertices + "f 0 1 2\n");
  ExpectBad("m.obj", vertices + "f 1 2 -4\n");
  ExpectBad("m.obj", vertices + "f 1 2 x\n");
  ExpectBad("m.obj", vertices + "f 1 2 99999999999999999999\n");
  ExpectBad("m.obj", vertices + "f 1 2 -9223372036854775808\n");
  ExpectBad("m.obj", vertices + "f 1 2 9223372036854775807\n");
  ExpectBad("m.obj", "v 0 0\n" + vertices + "f 1 2 3\n");
  ExpectBad("m.obj", "v 0 0 nan\n" + vertices + "f 1 2 3\n");
}

TEST_F(MeshIo, UnreadableAndUnknownFilesAreBadInput) {
  for (const char* name : {"absent.ply", "absent.obj", "mesh.stl", ""}) {
    const auto mesh = ReadMesh(folder_.path() / name);
    ASSERT_FALSE(mesh);
    EXPECT_EQ(mesh.error().kind, ErrorKind::bad_input);
  }
}

TEST_F(MeshIo, EveryTruncationOfABinaryPlyIsBadInput) {
  ASSERT_TRUE(WritePly(folder_.path() / "m.ply", meshes::Icosphere(1, 0)));
  const std::string whole = Bytes(folder_.path() / "m.ply");
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto mesh = Read("cut.ply", whole.substr(0, size));
    ASSERT_FALSE(mesh) << size;
    EXPECT_EQ(mesh.error().kind, ErrorKind::bad_input);
  }
}

// What a mutated file gives is either an error or a mesh that keeps its promises.
TEST_F(MeshIo, MutatedFilesNeverCrash) {
  ASSERT_TRUE(WritePly(folder_.path() / "m.ply", meshes::Icosphere(1, 0)));
  AtlasMesh atlas;
  atlas.mesh = meshes::Icosphere(1, 0);
  atlas.uv.assign(atlas.mesh.vertices.size(), {0.25, 0.5});
  for (std::uint32_t v = 0; v < atlas.mesh.vertices.size(); ++v) atlas.source_vertex.push_back(v);
  atlas.chart.assign(atlas.mesh.faces.size(), 0);
  ASSERT_TRUE(WriteAtlasObj(folder_.path() / "m.obj", atlas, ""));
  const std::pair<std::string, std::string> seeds[] = {{"x.ply", kAsciiTriangle},
                                                       {"x.ply", OddPly(true)},
                                                       {"x.ply", Bytes(folder_.path() / "m.ply")},
                                                       {"x.obj", Bytes(folder_.path() / "m.obj")}};
  Rng rng(1);
  int accepted = 0;
  for (const auto& [name, seed] : seeds) {
    for (int round = 0; round < 1500; ++round) {
      std::string text = seed;
      for (std::uint64_t edit = rng.Below(4) + 1; edit > 0 && !text.empty(); --edit) {
        const std::size_t at = rng.Below(text.size());
        switch (rng.Below(5)) {
          case 0:
            text[at] = static_cast<char>(rng.Below(256));
            break;
          case 1:
            text.erase(at, rng.Below(20) + 1);
            break;
          case 2:
            text.insert(at, text.substr(rng.Below(text.size()), rng.Below(20)));
            break;
          case 3:
            text[at] = "0123456789-+.e/ \n"[rng.Below(17)];
            break;
          default:
            text.resize(at);
        }
      }
      const auto mesh = Read(name, text);
      if (name == "x.obj") (void)ReadAtlasObj(folder_.path() / name);
      if (!mesh) {
        EXPECT_EQ(mesh.error().kind, ErrorKind::bad_input);
        continue;
      }
      ++accepted;
      ASSERT_FALSE(mesh->faces.empty());
      for (const Face& face : mesh->faces)
        for (const auto v : face) ASSERT_LT(v, mesh->vertices.size());
      for (const auto& v : mesh->vertices) ASSERT_TRUE(v.allFinite());
    }
  }
  EXPECT_GT(accepted, 100);
}

// Two triangles of a square, one in each of two charts.
AtlasMesh TwoCharts() {
  AtlasMesh atlas;
  atlas.mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}};
  atlas.mesh.vertices[1] = atlas.mesh.vertices[3] = {1.25, 0, 0};
  atlas.mesh.faces = {{0, 1, 2}, {5, 3, 4}};
  atlas.uv = {{0, 0}, {0.25, 0}, {0.25, 0.5}, {1, 0.5}, {1, 1}, {0.75, 0.875}};
  atlas.source_vertex = {0, 1, 2, 1, 3, 0};
  atlas.chart = {4, 9};
  return atlas;
}

TEST_F(MeshIo, AtlasComesBackAsWritten) {
  const AtlasMesh atlas = TwoCharts();
  const auto path = folder_.path() / "atlas.obj";
  ASSERT_TRUE(WriteAtlasObj(path, atlas, "albedo.png"));
  const auto read = ReadAtlasObj(path);
  ASSERT_TRUE(read) << ToString(read.error());
  EXPECT_EQ(read->mesh.vertices, atlas.mesh.vertices);
  EXPECT_EQ(read->mesh.faces, atlas.mesh.faces);
  EXPECT_EQ(read->uv, atlas.uv);
  EXPECT_EQ(read->source_vertex, atlas.source_vertex);
  EXPECT_EQ(read->chart, atlas.chart);
  EXPECT_NE(Bytes(folder_.path() / "atlas.mtl").find("map_Kd albedo.png"), std::string::npos);
  EXPECT_NE(Bytes(path).find("mtllib atlas.mtl"), std::string::npos);
}

TEST_F(MeshIo, AtlasObjIsAlsoAPlainMeshWhosePointsAreJoined) {
  const auto path = folder_.path() / "atlas.obj";
  ASSERT_TRUE(WriteAtlasObj(path, TwoCharts(), ""));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "atlas.mtl"));
  EXPECT_EQ(Bytes(path).find("mtllib"), std::string::npos);
  const auto mesh = ReadMesh(path);
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->vertices.size(), 4u);
  EXPECT_EQ(mesh->faces.size(), 2u);
}

TEST_F(MeshIo, ChartsOfForeignFilesAreTheirUvIslands) {
  const auto path = folder_.path() / "foreign.obj";
  std::ofstream(path) << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 0.5 0\nvt 0.5 0.5\n"
                         "vt 1 1\nvt 0.75 1\nvt 0.75 0.75\nf 1/1 2/2 3/3\nf 1/4 3/5 4/6\n";
  const auto atlas = ReadAtlasObj(path);
  ASSERT_TRUE(atlas) << ToString(atlas.error());
  EXPECT_EQ(atlas->chart, (std::vector<std::uint32_t>{0, 1}));
  EXPECT_EQ(atlas->uv[0], Eigen::Vector2d(0, 1));
  EXPECT_EQ(atlas->mesh.vertices.size(), 6u);
}

TEST_F(MeshIo, FacesWithoutTextureCoordinatesAreBadInput) {
  const auto path = folder_.path() / "bare.obj";
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 2 2\n";
  for (const char* face : {"f 1 2 3\n", "f 1/1 2/2 3/9\n", "f 1/1 2/2 3/3\n"}) {
    std::ofstream(path) << vertices << face;
    const auto atlas = ReadAtlasObj(path);
    ASSERT_FALSE(atlas) << face;
    EXPECT_EQ(atlas.error().kind, ErrorKind::bad_input);
  }
}

TEST_F(MeshIo, RealMeshesRead) {
  const std::filesystem::path data = SCAN_SOURCE_DIR "/../shared/data";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "shared data is absent";
  const auto fly = ReadMesh(data / "fruitfly_mesh/fruitfly.ply");
  ASSERT_TRUE(fly) << ToString(fly.error());
  EXPECT_EQ(fly->vertices.size(), 54905u);
  EXPECT_EQ(fly->faces.size(), 115072u);
  const auto skull = ReadMesh(data / "ct_head_invesalius/surface_0.ply");
  ASSERT_TRUE(skull) << ToString(skull.error());
  EXPECT_NEAR(SurfaceArea(*skull), 288983, 1);
  EXPECT_EQ(CheckTopology(*skull).boundary_edges, 14135u);
}

}  // namespace
}  // namespace scan
