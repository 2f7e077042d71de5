// ImportOptions::keep_polygons: the faces of a file as they are.
#include <gtest/gtest.h>

#include "common/import/mesh_import.h"
#include "tests/support/mesh_files.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

Result<ImportedMesh> import_text(const std::string& text, const std::string& name, bool keep = true) {
  ImportOptions options;
  options.keep_polygons = keep;
  return import_mesh_from_memory(text, name, options);
}

std::vector<std::vector<VertexId>> faces_of(const PolygonMesh& mesh) {
  std::vector<std::vector<VertexId>> faces;
  for (FaceId f = 0; f < mesh.face_count(); ++f) faces.emplace_back(mesh.face(f).begin(), mesh.face(f).end());
  return faces;
}

using Faces = std::vector<std::vector<VertexId>>;
const Faces kFaces = {{0, 1, 2, 3}, {0, 4, 1}, {1, 4, 5, 2, 0}};

TEST(PolygonImport, ObjPlyAndOffKeepTheirFacesInOrder) {
  const std::string points = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n";
  const std::string obj =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nf 1 2 3 4\nf 1/1/1 5/1 2//1\nf 2 5 6 3 -6\n";
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\nelement face 3\n"
      "property list uchar int vertex_indices\nend_header\n" +
      points + "4 0 1 2 3\n3 0 4 1\n5 1 4 5 2 0\n";
  const std::string off = "OFF\n6 3 0\n" + points + "4 0 1 2 3\n3 0 4 1\n5 1 4 5 2 0\n";
  for (const auto& [text, name] : {std::pair{obj, "a.obj"}, {ply, "a.ply"}, {off, "a.off"}}) {
    const Result<ImportedMesh> imported = import_text(text, name);
    ASSERT_TRUE(imported) << imported.error().message;
    EXPECT_EQ(faces_of(imported->polygons), kFaces) << name;
    ASSERT_EQ(imported->polygons.points.size(), 6U);
    for (std::size_t v = 0; v < 6; ++v) {
      EXPECT_EQ(imported->polygons.points[v], glm::dvec4(imported->mesh.positions[v], 1.0));
    }
    EXPECT_EQ(imported->mesh.triangles.size(), 6U) << name;
    EXPECT_EQ(import_text(text, name, false)->polygons.face_count(), 0U);
    EXPECT_EQ(import_text(text, name, false)->mesh.triangles, imported->mesh.triangles);
  }
}

TEST(PolygonImport, OtherFormatsGiveTheirTriangles) {
  const TriangleMesh mesh = testing::make_tetrahedron();
  const Result<ImportedMesh> imported = import_text(testing::stl_binary(mesh), "a.stl");
  ASSERT_TRUE(imported);
  EXPECT_EQ(imported->polygons.face_count(), 4U);
  EXPECT_EQ(imported->polygons.points.size(), imported->mesh.positions.size());
}

TEST(PolygonImport, ObjWeightsMakeHomogeneousPoints) {
  const std::string faces = "f 1 2 3\n";
  const auto imported = import_text("v 1 2 3\nv 4 5 6 2\nv 7 8 9 0.5 # a comment\n" + faces, "a.obj");
  ASSERT_TRUE(imported) << imported.error().message;
  EXPECT_EQ(imported->polygons.points[0], glm::dvec4(1, 2, 3, 1));
  EXPECT_EQ(imported->polygons.points[1], glm::dvec4(8, 10, 12, 2));
  EXPECT_EQ(imported->polygons.points[2], glm::dvec4(3.5, 4, 4.5, 0.5));
  EXPECT_EQ(imported->mesh.positions[1], glm::dvec3(4, 5, 6));
}

TEST(PolygonImport, ColoursBehindTheCoordinatesAreNoWeights) {
  const auto imported = import_text("v 0 0 0 0.1 0.2 0.3\nv 1 0 0 0 0 0\nv 0 1 0 1 1 1\nf 1 2 3\n", "a.obj");
  ASSERT_TRUE(imported) << imported.error().message;
  for (const glm::dvec4& point : imported->polygons.points) EXPECT_EQ(point.w, 1.0);
}

TEST(PolygonImport, WeightsThatPlaceNothingAreRefusedWithTheirLine) {
  for (const char* weight : {"0", "-1", "nan", "inf", "1e40"}) {
    const std::string text = "v 0 0 0\nv 1 0 0 " + std::string(weight) + "\nv 0 1 0\nf 1 2 3\n";
    const auto imported = import_text(text, "a.obj");
    ASSERT_FALSE(imported) << weight;
    EXPECT_EQ(imported.error().kind, ErrorKind::bad_input);
    EXPECT_NE(imported.error().message.find("line 2"), std::string::npos) << imported.error().message;
    EXPECT_TRUE(import_text(text, "a.obj", false)) << "without polygons weights are not looked at";
  }
}

}  // namespace
}  // namespace fanstream
