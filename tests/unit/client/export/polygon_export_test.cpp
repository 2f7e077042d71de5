#include "client/export/polygon_export.h"

#include <gtest/gtest.h>

#include "common/import/mesh_import.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/polygon_meshes.h"

namespace fanstream {
namespace {

using namespace fanstream::testing;

Result<ImportedMesh> read_back(const PolygonMesh& mesh, MeshFileFormat format, const std::string& name) {
  const auto bytes = encode_polygons(mesh, format);
  if (!bytes) return tl::unexpected(bytes.error());
  ImportOptions options;
  options.keep_polygons = true;
  return import_mesh_from_memory(std::string(bytes->begin(), bytes->end()), name, options);
}

TEST(PolygonExport, PlyAndObjGiveTheMeshBackExactly) {
  PolygonMesh many;
  for (unsigned i = 0; i < 300; ++i) many.points.emplace_back(i * 0.1, i * i * 0.01, 0, 1);
  std::vector<VertexId> all;
  for (VertexId v = 0; v < 300; ++v) all.push_back(v);
  many.add_face(all);  // more corners than a byte counts
  for (const PolygonMesh& mesh : {make_cube(), many, jittered(dual_of(make_sphere(7, 9)), 0.1, 1)}) {
    for (const auto& [format, name] : {std::pair{MeshFileFormat::ply, "a.ply"}, {MeshFileFormat::obj, "a.obj"}}) {
      const Result<ImportedMesh> back = read_back(mesh, format, name);
      ASSERT_TRUE(back) << back.error().message;
      EXPECT_TRUE(back->warnings.empty());
      EXPECT_EQ(back->polygons.points, mesh.points);
      EXPECT_EQ(back->polygons.corners, mesh.corners);
      EXPECT_EQ(back->polygons.face_begins, mesh.face_begins);
    }
  }
}

TEST(PolygonExport, ObjKeepsWeights) {
  const PolygonMesh mesh = with_random_weights(make_cube(), 3);
  const Result<ImportedMesh> back = read_back(mesh, MeshFileFormat::obj, "a.obj");
  ASSERT_TRUE(back) << back.error().message;
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    EXPECT_EQ(back->polygons.points[v].w, mesh.points[v].w);
    EXPECT_NEAR(back->polygons.points[v].x, mesh.points[v].x, 1e-15);
  }
}

TEST(PolygonExport, GlbHasTheTriangles) {
  const Result<ImportedMesh> back = read_back(make_cube(), MeshFileFormat::glb, "a.glb");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->mesh.triangles.size(), 12U);
}

TEST(PolygonExport, SaysWhatCannotBeWritten) {
  EXPECT_EQ(encode_polygons({}, MeshFileFormat::ply).error().kind, ErrorKind::usage);
  PolygonMesh mesh = make_cube();
  mesh.corners[3] = 99;
  EXPECT_EQ(encode_polygons(mesh, MeshFileFormat::obj).error().kind, ErrorKind::bad_input);
  mesh = make_cube();
  mesh.points[2].w = 0;
  EXPECT_EQ(encode_polygons(mesh, MeshFileFormat::ply).error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace fanstream
