// fanstream-client collide as a user runs it.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "client/collision/plane_contacts.h"
#include "client/export/mesh_export.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/built_model.h"
#include "tests/support/client_program.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

using testing::ProgramOutcome;

class CollideProgram : public testing::ClientProgramTest {
 protected:
  CollideProgram() : ClientProgramTest("collide") {}
  void SetUp() override { server.add("torus", asset()); }
  std::string source() const { return server.address() + "/torus"; }

  static const TriangleMesh& mesh() {
    static const TriangleMesh torus = testing::make_torus(160, 90);
    return torus;
  }
  static std::shared_ptr<const AssetFile> asset() {
    static const auto built = testing::build_model(mesh());
    return built;
  }

  testing::ModelServer server;
};

TEST_F(CollideProgram, HelpFitsEightyColumnsAndHasAnExample) { expect_help(run({"--help"})); }

TEST_F(CollideProgram, WithoutAFocusContactsAreThoseOfTheFullModel) {
  PlaneContacts expected;
  const Plane plane = make_plane(1, 0.2, 0.1, -1.2).value();
  find_contacts(patch_of(testing::on_grid(mesh(), asset()->asset_head()->grid)), plane, expected);
  ASSERT_GT(expected.touching, 0U);
  const nlohmann::json json = run_json({source(), "--plane", "1,0.2,0.1,-1.2", "--list", "5"});
  const nlohmann::json& found = json["planes"][0];
  EXPECT_EQ(found["touching"], expected.touching);
  EXPECT_EQ(found["touching_original"], expected.touching);
  EXPECT_EQ(found["listed"], 5);
  EXPECT_EQ(found["contacts"].size(), 5U);
  EXPECT_EQ(json["contacts_of_full_model"], true);
  EXPECT_LT(json["original_triangles"], mesh().triangles.size()) << "far from the plane nothing is restored";
  EXPECT_LT(json["bytes"]["received"], json["bytes"]["model"]);
}

TEST_F(CollideProgram, AFocusIsOriginalAndOneElsewhereIsNot) {
  const nlohmann::json near = run_json({source(), "--plane", "0,1,0,-0.01", "--focus", "1,0,0,0.2"});
  EXPECT_GT(near["focus_cells"], 0);
  EXPECT_GT(near["planes"][0]["touching_original"], 0);
  const nlohmann::json outside = run_json({source(), "--plane", "0,1,0,-0.01", "--focus", "50,0,0,0.2"});
  EXPECT_EQ(outside["focus_cells"], 0);
  EXPECT_EQ(outside["original_triangles"], 0);
  EXPECT_GT(outside["planes"][0]["touching"], 0) << "simplified ones";
  EXPECT_EQ(outside["planes"][0]["touching_original"], 0);
  EXPECT_EQ(outside["notes"].size(), 2U);
  EXPECT_LT(outside["bytes"]["received"], near["bytes"]["received"]);
  const nlohmann::json everywhere =
      run_json({source(), "--plane", "0,1,0,-0.01", "--focus", "50,0,0,0.2", "--coarseness", "0"});
  EXPECT_EQ(everywhere["original_triangles"], mesh().triangles.size());
}

TEST_F(CollideProgram, AMeshThatTouchesAndOneThatDoesNot) {
  for (const double x : {1.3, 5.0}) {
    TriangleMesh ball;
    testing::append(ball, testing::make_sphere(12, 16, 0.2), {x, 0, 0});
    const std::string file = (folder.path() / "ball.ply").string();
    ASSERT_TRUE(export_mesh(file, ball.positions, ball.triangles));
    const nlohmann::json json = run_json({source(), "--with", file});
    const nlohmann::json& found = json["mesh"];
    EXPECT_EQ(found["triangles"], ball.triangles.size());
    EXPECT_EQ(found["touching_pairs"], found["original_pairs"]);
    EXPECT_EQ(found["touching_pairs"] > 0, x < 2.0);
    EXPECT_EQ(found["distance"].is_null(), x < 2.0);
    if (x < 2.0) continue;
    EXPECT_NEAR(found["distance"]["least"].get<double>(), 5.0 - 0.2 - 1.35, 0.2);
  }
}

TEST_F(CollideProgram, MistakesAreNamedWithTheirExitCodes) {
  const std::string empty = folder.write("empty.ply", "").string();
  expect_failure(run({source()}), ErrorKind::usage, "--plane a,b,c,d or --with FILE");
  expect_failure(run({source(), "--plane", "1,2,3"}), ErrorKind::usage, "--plane 1,2,3");
  expect_failure(run({source(), "--plane", "1,2,3,x"}), ErrorKind::usage, "--plane 1,2,3,x");
  expect_failure(run({source(), "--plane", "0,0,0,1"}), ErrorKind::usage, "zero");
  expect_failure(run({source(), "--plane", "nan,0,0,1"}), ErrorKind::usage, "not finite");
  expect_failure(run({source(), "--plane", "-1,0,0,1", "--focus", "0,0,0,-1"}), ErrorKind::usage, "negative");
  expect_failure(run({source(), "--plane", "1,0,0,1", "--focus", "0,0,inf,1"}), ErrorKind::usage, "--focus");
  expect_failure(run({source(), "--plane", "1,0,0,1", "--direction", "0,0,0"}), ErrorKind::usage, "--direction");
  expect_failure(run({source(), "--plane", "1,0,0,1", "--angle", "20"}), ErrorKind::usage, "--angle");
  expect_failure(run({source(), "--plane", "1,0,0,1", "--coarseness", "-1"}), ErrorKind::usage, "--coarseness");
  expect_failure(run({source(), "--with", empty}), ErrorKind::bad_input, "empty.ply");
  expect_failure(run({source(), "--with", "no/such.ply"}), ErrorKind::not_found, "no/such.ply");
  expect_failure(run({"no/such.fan", "--plane", "1,0,0,1"}), ErrorKind::not_found, "no/such.fan");
  expect_failure(run({server.address() + "/none", "--plane", "1,0,0,1"}), ErrorKind::not_found, "none");
}

}  // namespace
}  // namespace fanstream
