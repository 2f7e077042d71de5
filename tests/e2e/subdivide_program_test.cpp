// fanstream-client subdivide as a user runs it: files, pictures, messages, exit codes.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "client/export/polygon_export.h"
#include "client/subdivide/subdivision.h"
#include "common/import/mesh_import.h"
#include "tests/support/client_program.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/polygon_meshes.h"

namespace fanstream {
namespace {

using namespace fanstream::testing;

class SubdivideProgram : public ClientProgramTest {
 protected:
  SubdivideProgram() : ClientProgramTest("subdivide") {}
  std::string write(const PolygonMesh& mesh, const std::string& name) {
    EXPECT_TRUE(export_polygons(out(name), mesh));
    return out(name);
  }
  PolygonMesh read(const std::string& name) {
    ImportOptions options;
    options.keep_polygons = true;
    const Result<ImportedMesh> imported = import_mesh(out(name), options);
    EXPECT_TRUE(imported) << imported.error().message;
    return imported ? imported->polygons : PolygonMesh();
  }
};

TEST_F(SubdivideProgram, WritesTheUniformMesh) {
  const PolygonMesh mesh = with_dissolved_edges(polygon_mesh(make_torus(12, 8)), 0.4, 1);
  const std::string cage = write(mesh, "cage.obj");
  for (const char* name : {"out.obj", "out.ply"}) {
    const auto result = run({cage, "--depth", "4", "-o", out(name), "--json"});
    ASSERT_EQ(result.exit_code, 0) << result.error;
    const Result<PolygonMesh> expected = subdivide(mesh, 4);
    const PolygonMesh written = read(name);
    EXPECT_EQ(written.points, expected->points);
    EXPECT_EQ(written.corners, expected->corners);
    const auto json = nlohmann::json::parse(result.out);
    EXPECT_EQ(json["faces"], expected->face_count());
    EXPECT_EQ(json["input_faces"], mesh.face_count());
  }
}

TEST_F(SubdivideProgram, RefinesForAViewAndDrawsIt) {
  const std::string cage = write(make_quad_torus(40, 28), "cage.ply");
  const auto result = run({cage, "--view", "--eye", "0,0.5,4", "-o", out("out.obj"), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.error;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["faces_by_depth"].size(), 9U);
  EXPECT_GT(json["faces_by_depth"][0], 0U);
  EXPECT_GT(json["silhouette_faces"], 0U);
  const PolygonMesh written = read("out.obj");
  EXPECT_EQ(json["faces"], written.face_count());
  EXPECT_TRUE(check_polygons(written));
  const auto picture =
      run({cage, "--eye", "0,0.5,4", "--picture-eye", "4,0,0", "--size", "320x240", "-o", out("a.png")});
  EXPECT_EQ(picture.exit_code, 0) << picture.error;
  EXPECT_GT(std::filesystem::file_size(out("a.png")), 5000U);
}

// The side that faces the eye is found although the file winds its faces the other way.
TEST_F(SubdivideProgram, InwardFacesAreRefinedOnTheSideThatIsSeen) {
  PolygonMesh mesh = polygon_mesh(make_sphere(20, 30));
  const std::vector<std::string> view = {"--view", "--eye", "0,0,5", "--json", "-o", out("out.ply")};
  const auto faces = [&](const std::string& file) {
    std::vector<std::string> arguments = view;
    arguments.insert(arguments.begin(), file);
    const auto result = run(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.error;
    return nlohmann::json::parse(result.out);
  };
  const auto outward = faces(write(mesh, "outward.ply"));
  for (FaceId f = 0; f < mesh.face_count(); ++f) std::swap(mesh.corners[3 * f], mesh.corners[3 * f + 1]);
  const auto inward = faces(write(mesh, "inward.ply"));
  EXPECT_EQ(inward["faces_by_depth"], outward["faces_by_depth"]);
  EXPECT_EQ(inward["front_faces"], outward["front_faces"]);
  EXPECT_EQ(inward["warnings"].size(), 1U);
}

TEST_F(SubdivideProgram, SaysWhatIsWrongAndWritesNothing) {
  const std::string cage = write(make_cube(), "cage.obj");
  const std::string file = out("out.obj");
  const auto expect = [&](const std::vector<std::string>& arguments, int code, const std::string& message) {
    const auto result = run(arguments);
    EXPECT_EQ(result.exit_code, code) << result.error;
    EXPECT_NE((result.error + result.out).find(message), std::string::npos) << result.error;
    EXPECT_FALSE(std::filesystem::exists(file));
  };
  expect({cage, "-o", file}, 2, "--depth N");
  expect({cage, "--depth", "2", "--view", "-o", file}, 2, "--depth N");
  expect({cage, "--depth", "two", "-o", file}, 2, "--depth");
  expect({cage, "--depth", "2", "-o", out("out.xyz")}, 2, ".ply");
  expect({cage, "--depth", "2", "-o", out("none/out.obj")}, 3, "make it first");
  expect({out("none.obj"), "--depth", "2", "-o", file}, 3, "none.obj");
  expect({cage, "--depth", "90", "-o", file}, 7, "greatest");
  expect({cage, "--view", "--max-corners", "100", "-o", file}, 7, "limit");
  expect({cage, "--view", "--eye", "1,2", "-o", file}, 2, "--eye");
  folder.write("empty.obj", "");
  expect({out("empty.obj"), "--view", "-o", file}, 5, "empty");
}

}  // namespace
}  // namespace fanstream
