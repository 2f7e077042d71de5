// fanstream-client reduce as a user runs it.
#include <gtest/gtest.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "common/import/mesh_import.h"
#include "common/mesh/mesh_hash.h"
#include "tests/support/built_model.h"
#include "tests/support/client_program.h"
#include "tests/support/mesh_files.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

namespace fs = std::filesystem;
using testing::ProgramOutcome;

class ReduceProgram : public testing::ClientProgramTest {
 protected:
  ReduceProgram() : ClientProgramTest("reduce") {}
  nlohmann::json run_json(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--size", "80x60"});
    return ClientProgramTest::run_json(std::move(arguments));
  }
  static std::size_t triangles_of(const std::string& file) {
    const auto imported = import_mesh(file);
    EXPECT_TRUE(imported) << imported.error().message;
    return imported ? imported->mesh.triangles.size() : 0;
  }
  std::string torus_file(const char* name = "torus.ply") const {
    return folder.write(name, testing::ply_text(testing::make_torus(40, 30))).string();
  }
};

TEST_F(ReduceProgram, HelpFitsEightyColumnsAndHasAnExample) { expect_help(run({"--help"})); }

TEST_F(ReduceProgram, AMeshFileGivesAFileForEachCountAndAPicture) {
  for (const char* format : {"glb", "ply", "obj"}) {
    const nlohmann::json json =
        run_json({torus_file(), "--triangles", "200,1000,200", "-o", out(format), "--format", format});
    ASSERT_EQ(json["levels"].size(), 2U) << "sorted, each once";
    EXPECT_EQ(json["source_triangles"], 2400);
    EXPECT_EQ(json["used_again"], false);
    EXPECT_EQ(json["degraded"], false);
    for (const auto& level : json["levels"]) {
      EXPECT_EQ(level["triangles"], level["asked_triangles"]);
      EXPECT_EQ(level["reached"], true);
      EXPECT_EQ(triangles_of(level["file"]), level["triangles"]);
      EXPECT_EQ(fs::file_size(level["file"].get<std::string>()), level["size_bytes"]);
      EXPECT_GT(level["relative_rms"], 0.0);
      EXPECT_GE(level["relative_max"], level["relative_rms"]);
    }
    EXPECT_GT(json["levels"][1]["relative_rms"], json["levels"][0]["relative_rms"]);
    EXPECT_GT(fs::file_size(json["picture"].get<std::string>()), 2000U);
    EXPECT_EQ(fs::path(json["levels"][0]["file"].get<std::string>()).filename(),
              std::string("torus_1000.").append(format));
  }
}

TEST_F(ReduceProgram, AServersModelAndAnAssetFileAreSourcesToo) {
  testing::ModelServer server;
  const auto asset = testing::build_model(testing::make_torus(40, 30));
  server.add("torus", asset);
  const std::string file =
      folder.write("torus.fan", {reinterpret_cast<const char*>(asset->bytes().data()), asset->bytes().size()}).string();
  const nlohmann::json streamed = run_json({server.address() + "/torus", "--triangles", "500", "-o", out("streamed")});
  const nlohmann::json read = run_json({file, "--triangles", "500", "-o", out("read")});
  EXPECT_EQ(streamed["source_hash"], std::string("asset ").append(text_of(asset->digest())));
  EXPECT_EQ(streamed["source_hash"], read["source_hash"]);
  ASSERT_EQ(streamed["levels"][0]["triangles"], 500);
  const auto mesh = [](const nlohmann::json& json) {
    return mesh_hash(import_mesh(json["levels"][0]["file"].get<std::string>())->mesh);
  };
  EXPECT_EQ(mesh(streamed), mesh(read));
  EXPECT_EQ(run_json({server.address() + "/torus", "--triangles", "500", "-o", out("streamed")})["used_again"], true);
  EXPECT_EQ(run_json({file, "--triangles", "500", "-o", out("streamed")})["used_again"], true)
      << "it is the same asset";
}

TEST_F(ReduceProgram, ASecondRunUsesWhatIsStoredUntilSomethingChanges) {
  const std::string source = torus_file();
  const std::vector<std::string> arguments{source, "--triangles", "600,300", "-o", out("lods")};
  const nlohmann::json first = run_json(arguments);
  const auto file = first["levels"][1]["file"].get<std::string>();
  const auto written = fs::last_write_time(file);
  const nlohmann::json second = run_json(arguments);
  EXPECT_EQ(second["used_again"], true);
  EXPECT_EQ(second["levels"], first["levels"]);
  EXPECT_EQ(fs::last_write_time(file), written);
  const ProgramOutcome text = run({source, "--triangles", "600,300", "-o", out("lods"), "--size", "80x60"});
  EXPECT_NE(text.out.find("nothing to do"), std::string::npos) << text.out;

  { std::ofstream(file, std::ios::app) << "damage"; }
  const nlohmann::json repaired = run_json(arguments);
  EXPECT_EQ(repaired["used_again"], false);
  EXPECT_EQ(repaired["made_because"], "torus_300.glb has changed");
  EXPECT_EQ(repaired["levels"], first["levels"]);
  EXPECT_EQ(run_json(arguments)["used_again"], true);

  fs::remove(out("lods") + "/levels.json");
  EXPECT_EQ(run_json(arguments)["used_again"], false);
  folder.write("torus.ply", testing::ply_text(testing::make_torus(40, 31)));
  const nlohmann::json changed = run_json(arguments);
  EXPECT_EQ(changed["used_again"], false);
  EXPECT_NE(changed["made_because"].get<std::string>().find("source has changed"), std::string::npos);
  const nlohmann::json other = run_json({source, "--triangles", "600", "-o", out("lods")});
  EXPECT_NE(other["made_because"].get<std::string>().find("other numbers"), std::string::npos);
}

TEST_F(ReduceProgram, GltfThatNamesABufferIsMadeAnewWhenThatChanges) {
  testing::GltfDraft draft = testing::gltf_draft(testing::make_torus(20, 12));
  const std::string source = folder.write("torus.gltf", draft.as_gltf_with_uri("torus.bin")).string();
  folder.write("torus.bin", draft.binary);
  const std::vector<std::string> arguments{source, "--triangles", "100", "-o", out("lods")};
  EXPECT_EQ(run_json(arguments)["levels"][0]["triangles"], 100);
  EXPECT_EQ(run_json(arguments)["used_again"], true);
  TriangleMesh moved = testing::make_torus(20, 12);
  for (glm::dvec3& p : moved.positions) p.x += 1.0;
  folder.write("torus.bin", testing::gltf_draft(moved).binary);
  EXPECT_EQ(run_json(arguments)["used_again"], false);
}

TEST_F(ReduceProgram, TextureCoordinatesGoAlong) {
  const TriangleMesh mesh = testing::make_grid(20, 20);
  std::ostringstream text;
  for (const glm::dvec3& p : mesh.positions) {
    text << "v " << p.x << ' ' << p.y << " 0\nvt " << p.x / 20 << ' ' << p.y / 20 << '\n';
  }
  for (const Triangle& t : mesh.triangles) {
    text << 'f';
    for (const VertexId v : t) text << ' ' << v + 1 << '/' << v + 1;
    text << '\n';
  }
  const nlohmann::json json = run_json(
      {folder.write("grid.obj", text.str()).string(), "--triangles", "50", "-o", out("lods"), "--format", "glb"});
  EXPECT_EQ(json["texture_coordinates"], true);
  ImportOptions options;
  options.keep_attributes = true;
  const auto level = import_mesh(json["levels"][0]["file"].get<std::string>(), options);
  ASSERT_TRUE(level) << level.error().message;
  ASSERT_EQ(level->attributes.texture_coordinates.size(), level->mesh.positions.size());
  for (std::size_t v = 0; v < level->mesh.positions.size(); ++v) {
    EXPECT_NEAR(level->attributes.texture_coordinates[v].x, level->mesh.positions[v].x / 20, 1e-5);
    EXPECT_NEAR(level->attributes.texture_coordinates[v].y, 1.0 - level->mesh.positions[v].y / 20, 1e-5);
  }
}

TEST_F(ReduceProgram, CountsOutOfReachAreSaidAndTheirFilesKept) {
  const nlohmann::json json = run_json({torus_file(), "--triangles", "500,3", "-o", out("lods")});
  EXPECT_EQ(json["degraded"], true);
  EXPECT_EQ(json["levels"][0]["reached"], true);
  EXPECT_EQ(json["levels"][1]["reached"], false);
  EXPECT_NE(json["levels"][1]["shortfall"].get<std::string>().find("topology"), std::string::npos);
  EXPECT_EQ(triangles_of(json["levels"][1]["file"]), json["levels"][1]["triangles"]);
  const ProgramOutcome text = run({torus_file(), "--triangles", "500,3", "-o", out("text"), "--no-picture"});
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_NE(text.out.find("degraded    3 triangles were not reached"), std::string::npos) << text.out;
  EXPECT_FALSE(fs::exists(out("text") + "/levels.png"));
}

TEST_F(ReduceProgram, MistakesAreNamedWithTheirExitCodes) {
  const std::string torus = torus_file();
  const std::string lods = out("lods");
  const auto reduce = [&](const std::string& source, const std::string& counts, const std::string& output) {
    return run({source, "--triangles", counts, "-o", output});
  };
  expect_failure(run({torus, "-o", lods}), ErrorKind::usage, "--triangles");
  expect_failure(run({torus, "--triangles", "10"}), ErrorKind::usage, "--output");
  for (const char* counts : {"0", "-5", "many", "10,,20", "10,0", "99999999999999999999"}) {
    expect_failure(reduce(torus, counts, lods), ErrorKind::usage, "--triangles");
  }
  expect_failure(reduce("no/such.ply", "10", lods), ErrorKind::not_found, "no/such.ply");
  expect_failure(reduce(folder.path().string(), "10", lods), ErrorKind::io, folder.path().string());
  expect_failure(reduce(folder.write("empty.ply", "").string(), "10", lods), ErrorKind::bad_input, "empty.ply");
  expect_failure(reduce(folder.write("empty.fan", "").string(), "10", lods), ErrorKind::bad_input, "empty.fan");
  expect_failure(reduce(folder.write("a.txt", "no mesh").string(), "10", lods), ErrorKind::unsupported, "a.txt");
  expect_failure(reduce(folder.write("flat.off", "OFF\n3 1 0\n0 0 0\n0 0 0\n0 0 0\n3 0 1 2\n").string(), "10", lods),
                 ErrorKind::bad_input, "degenerate");
  expect_failure(reduce("127.0.0.1:1/bunny", "10", lods), ErrorKind::network, "127.0.0.1:1");
  expect_failure(reduce("127.0.0.1:1", "10", lods), ErrorKind::usage, "HOST:PORT/MODEL");
  expect_failure(reduce(torus, "10", torus), ErrorKind::usage, "is a file");
  expect_failure(reduce(torus, "10", out("none/lods")), ErrorKind::not_found, "none");
  expect_failure(reduce(torus, "10", "/proc/lods"), ErrorKind::io, "/proc/lods");
  expect_failure(run({torus, "--triangles", "10", "-o", lods, "--format", "stl"}), ErrorKind::usage, "stl");
  expect_failure(run({torus, "--triangles", "10", "-o", lods, "--weight", "two"}), ErrorKind::usage, "two");
  expect_failure(run({torus, "--triangles", "10", "-o", lods, "--size", "0x5"}), ErrorKind::usage, "--size");
  EXPECT_FALSE(fs::exists(lods)) << "nothing is made where nothing can be written into it";
  if (::geteuid() == 0) return;  // root writes anywhere
  fs::create_directory(lods);
  fs::permissions(lods, fs::perms::owner_read | fs::perms::owner_exec);
  expect_failure(reduce(torus, "10", lods), ErrorKind::io, lods);
}

}  // namespace
}  // namespace fanstream
