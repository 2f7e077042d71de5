#include "client/export/mesh_export.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/fan_test_meshes.h"

namespace fanstream {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

TriangleMesh float_torus() {
  TriangleMesh mesh = test::make_torus(7, 5);
  for (glm::dvec3& p : mesh.positions) p = glm::dvec3(glm::vec3(p));
  return mesh;
}

Bytes encoded(const TriangleMesh& mesh, MeshFileFormat format) {
  auto bytes = encode_mesh(mesh.positions, mesh.triangles, format);
  EXPECT_TRUE(bytes) << bytes.error().message;
  return *bytes;
}

template <class T>
T number_at(const Bytes& bytes, std::size_t offset) {
  T value{};
  EXPECT_LE(offset + sizeof value, bytes.size());
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

// Reads what the header promises, number by number.
template <class Real>
void expect_ply_holds(const Bytes& bytes, const TriangleMesh& mesh, const std::string& type) {
  const std::string all(bytes.begin(), bytes.end());
  const std::string end = "end_header\n";
  std::size_t offset = all.find(end);
  ASSERT_NE(offset, std::string::npos);
  const std::string header = all.substr(0, offset);
  EXPECT_NE(header.find("element vertex " + std::to_string(mesh.positions.size())), std::string::npos);
  EXPECT_NE(header.find("element face " + std::to_string(mesh.triangles.size())), std::string::npos);
  EXPECT_NE(header.find("property " + type + " z"), std::string::npos);
  offset += end.size();
  for (const glm::dvec3& p : mesh.positions) {
    for (int axis = 0; axis < 3; ++axis, offset += sizeof(Real)) EXPECT_EQ(number_at<Real>(bytes, offset), p[axis]);
  }
  for (const Triangle& t : mesh.triangles) {
    EXPECT_EQ(bytes[offset++], 3);
    for (std::size_t k = 0; k < 3; ++k, offset += 4) EXPECT_EQ(number_at<std::uint32_t>(bytes, offset), t[k]);
  }
  EXPECT_EQ(offset, bytes.size());
}

TEST(MeshExport, PlyGivesBackEveryCoordinateAsFloatOrDouble) {
  const TriangleMesh floats = float_torus();
  expect_ply_holds<float>(encoded(floats, MeshFileFormat::ply), floats, "float");
  TriangleMesh doubles = floats;
  doubles.positions[3].y += 1e-12;
  expect_ply_holds<double>(encoded(doubles, MeshFileFormat::ply), doubles, "double");
  doubles.positions[3].y = 1e300;
  expect_ply_holds<double>(encoded(doubles, MeshFileFormat::ply), doubles, "double");
}

TEST(MeshExport, RoundingThroughFloatRounds) {
  for (const glm::dvec3& p : float_torus().positions) {
    for (int axis = 0; axis < 3; ++axis) {
      const volatile float rounded = static_cast<float>(p[axis]);
      EXPECT_EQ(static_cast<double>(rounded), p[axis]) << "the compiler miscompiles; see -fno-tree-slp-vectorize";
    }
  }
}

TEST(MeshExport, ObjGivesBackEveryCoordinate) {
  TriangleMesh mesh = test::make_torus(7, 5);
  mesh.positions[0] = {0.1, 1.0 / 3.0, -1e-300};
  const Bytes bytes = encoded(mesh, MeshFileFormat::obj);
  std::istringstream in(std::string(bytes.begin(), bytes.end()));
  TriangleMesh read;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string a, b, c, kind;
    words >> kind >> a >> b >> c;
    if (kind == "v")
      read.positions.emplace_back(std::strtod(a.c_str(), nullptr), std::strtod(b.c_str(), nullptr),
                                  std::strtod(c.c_str(), nullptr));
    if (kind == "f") {
      const auto index = [](const std::string& word) { return static_cast<VertexId>(std::stoul(word) - 1); };
      read.triangles.push_back({index(a), index(b), index(c)});
    }
  }
  EXPECT_EQ(read.positions, mesh.positions);
  EXPECT_EQ(read.triangles, mesh.triangles);
}

TEST(MeshExport, GlbIsWellFormedAndHoldsTheMesh) {
  const TriangleMesh mesh = float_torus();
  const Bytes bytes = encoded(mesh, MeshFileFormat::glb);
  EXPECT_EQ(std::memcmp(bytes.data(), "glTF\2\0\0\0", 8), 0);
  EXPECT_EQ(number_at<std::uint32_t>(bytes, 8), bytes.size());
  const std::size_t json_bytes = number_at<std::uint32_t>(bytes, 12);
  EXPECT_EQ(json_bytes % 4, 0U);
  const auto json =
      nlohmann::json::parse(bytes.begin() + 20, bytes.begin() + 20 + static_cast<std::ptrdiff_t>(json_bytes));
  const std::size_t data = 20 + json_bytes + 8;
  EXPECT_EQ(number_at<std::uint32_t>(bytes, data - 8), bytes.size() - data);
  EXPECT_EQ(json["buffers"][0]["byteLength"], bytes.size() - data);
  const auto& primitive = json["meshes"][0]["primitives"][0];
  const auto view_of = [&](int accessor) {
    return json["bufferViews"][json["accessors"][accessor]["bufferView"].get<std::size_t>()];
  };
  const int points = primitive["attributes"]["POSITION"];
  const int indices = primitive["indices"];
  EXPECT_EQ(json["accessors"][points]["count"], mesh.positions.size());
  EXPECT_EQ(json["accessors"][indices]["count"], 3 * mesh.triangles.size());
  Bounds box = bounds_of(mesh.positions);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(json["accessors"][points]["min"][axis].get<float>(), box.low[static_cast<int>(axis)]);
    EXPECT_EQ(json["accessors"][points]["max"][axis].get<float>(), box.high[static_cast<int>(axis)]);
  }
  std::size_t offset = data + view_of(points)["byteOffset"].get<std::size_t>();
  for (const glm::dvec3& p : mesh.positions) {
    for (int axis = 0; axis < 3; ++axis, offset += 4) EXPECT_EQ(number_at<float>(bytes, offset), p[axis]);
  }
  offset = data + view_of(indices)["byteOffset"].get<std::size_t>();
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k, offset += 4) EXPECT_EQ(number_at<std::uint32_t>(bytes, offset), t[k]);
  }
  EXPECT_EQ(offset, bytes.size());
}

TEST(MeshExport, RefusesMeshesNoFileCanHold) {
  const TriangleMesh good = float_torus();
  const auto complaint = [&](MeshFileFormat format, auto&& damage) {
    TriangleMesh bad = good;
    damage(bad);
    const auto bytes = encode_mesh(bad.positions, bad.triangles, format);
    return bytes ? std::string() : bytes.error().message;
  };
  for (const MeshFileFormat format : {MeshFileFormat::ply, MeshFileFormat::obj, MeshFileFormat::glb}) {
    EXPECT_NE(complaint(format, [](TriangleMesh& m) { m.triangles.clear(); }), "");
    EXPECT_NE(
        complaint(format, [](TriangleMesh& m) { m.triangles[4][1] = 35; }).find("triangle 4 names vertex 35 of 35"),
        std::string::npos);
    EXPECT_NE(complaint(format, [](TriangleMesh& m) { m.positions[9].z = std::numeric_limits<double>::infinity(); })
                  .find("vertex 9"),
              std::string::npos);
  }
  EXPECT_NE(complaint(MeshFileFormat::glb, [](TriangleMesh& m) { m.positions[9].z = 1e39; }).find("vertex 9"),
            std::string::npos);
}

TEST(MeshExport, ChoosesTheFormatByExtension) {
  EXPECT_EQ(*mesh_file_format("a/b.PLY"), MeshFileFormat::ply);
  EXPECT_EQ(*mesh_file_format("b.x.obj"), MeshFileFormat::obj);
  EXPECT_EQ(*mesh_file_format("b.glb"), MeshFileFormat::glb);
  for (const char* name : {"b.stl", "b", "", ".ply/b"}) {
    const auto format = mesh_file_format(name);
    ASSERT_FALSE(format) << name;
    EXPECT_NE(format.error().message.find(".ply, .obj or .glb"), std::string::npos);
  }
}

class MeshExportFiles : public testing::Test {
 protected:
  MeshExportFiles() : directory_(fs::temp_directory_path() / ("fanstream_export_test_" + std::to_string(::getpid()))) {
    fs::remove_all(directory_);
    fs::create_directories(directory_);
  }
  ~MeshExportFiles() override { fs::remove_all(directory_); }
  const fs::path directory_;
  const TriangleMesh mesh_ = float_torus();
};

TEST_F(MeshExportFiles, AreWholeAndKeepTheOldFilesPermissions) {
  const fs::path path = directory_ / "torus.ply";
  std::ofstream(path) << "old";
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
  ASSERT_TRUE(export_mesh(path, mesh_.positions, mesh_.triangles));
  EXPECT_EQ(fs::file_size(path), encoded(mesh_, MeshFileFormat::ply).size());
  EXPECT_EQ(fs::status(path).permissions(), fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
  EXPECT_EQ(std::distance(fs::directory_iterator(directory_), {}), 1);
}

TEST_F(MeshExportFiles, ThatFailOnAFullDiskSaySo) {
  fs::create_symlink("/dev/full", directory_ / "full.ply");
  const auto full = export_mesh(directory_ / "full.ply", mesh_.positions, mesh_.triangles);
  ASSERT_FALSE(full);
  EXPECT_EQ(full.error().kind, ErrorKind::io);
  EXPECT_NE(full.error().message.find("No space left"), std::string::npos);
}

TEST_F(MeshExportFiles, ThatFailLeaveTheOldFileUntouched) {
  const fs::path path = directory_ / "torus.glb";
  std::ofstream(path) << "old";
  TriangleMesh bad = mesh_;
  bad.positions[0].x = std::numeric_limits<double>::quiet_NaN();
  const auto failed = export_mesh(path, bad.positions, bad.triangles);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().message.find(path.string()), 0U);
  EXPECT_EQ(fs::file_size(path), 3U);
  EXPECT_FALSE(export_mesh(directory_ / "missing" / "torus.ply", mesh_.positions, mesh_.triangles));
  EXPECT_EQ(std::distance(fs::directory_iterator(directory_), {}), 1);
}

TEST_F(MeshExportFiles, FollowSymbolicLinks) {
  std::ofstream(directory_ / "real.obj") << "old";
  fs::create_symlink("real.obj", directory_ / "link.obj");
  ASSERT_TRUE(export_mesh(directory_ / "link.obj", mesh_.positions, mesh_.triangles));
  EXPECT_TRUE(fs::is_symlink(directory_ / "link.obj"));
  EXPECT_GT(fs::file_size(directory_ / "real.obj"), 3U);
}

}  // namespace
}  // namespace fanstream
