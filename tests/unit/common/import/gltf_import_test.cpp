// What is particular to glTF and GLB.
#include <gtest/gtest.h>

#include <cstring>

#include "common/import/mesh_import.h"
#include "tests/support/drawn_triangles.h"
#include "tests/support/mesh_files.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/temporary_folder.h"

namespace fanstream {
namespace {

using namespace fanstream::testing;
using nlohmann::json;

TriangleMesh import_glb(const GltfDraft& draft) {
  const Result<ImportedMesh> imported = import_mesh_from_memory(draft.as_glb(), "a.glb");
  EXPECT_TRUE(imported) << imported.error().message;
  return imported ? imported->mesh : TriangleMesh{};
}

std::string error_of(const GltfDraft& draft, const ImportOptions& options = {}) {
  const Result<ImportedMesh> imported = import_mesh_from_memory(draft.as_glb(), "a.glb", options);
  return imported ? "no error" : imported.error().message;
}

// One triangle as mesh 0, without nodes.
GltfDraft one_triangle() {
  GltfDraft draft;
  const int positions = draft.add_positions({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}});
  draft.add_mesh({{"attributes", {{"POSITION", positions}}}});
  return draft;
}

TEST(Gltf, ComposesTransformsAndPlacesInstances) {
  GltfDraft draft = one_triangle();
  const double half = std::sqrt(0.5);
  draft.add_node({{"children", {1, 2}}, {"translation", {10, 0, 0}}});
  draft.add_node({{"mesh", 0}, {"rotation", {0, 0, half, half}}, {"scale", {2, 3, 1}}});  // a quarter turn about z
  draft.add_node({{"children", {3}}, {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 5, 0, 1}}});
  draft.add_node({{"mesh", 0}});
  draft.add_node({{"mesh", 0}, {"translation", {99, 99, 99}}});  // in no scene
  draft.use_scene({0});
  const TriangleMesh mesh = import_glb(draft);
  const std::vector<glm::dvec3> expected = {{10, 0, 0}, {10, 2, 0}, {7, 0, 0}, {10, 5, 0}, {11, 5, 0}, {10, 6, 0}};
  ASSERT_EQ(mesh.positions.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(mesh.positions[i][axis], expected[i][axis], 1e-12) << i;
  }
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {3, 4, 5}}));
}

TEST(Gltf, AMirroringTransformFlipsTheWinding) {
  GltfDraft draft = one_triangle();
  draft.add_node({{"mesh", 0}, {"scale", {-1, 1, 1}}});
  draft.add_node({{"mesh", 0}, {"scale", {-1, -1, 1}}});
  draft.use_scene({0, 1});
  EXPECT_EQ(import_glb(draft).triangles, (std::vector<Triangle>{{0, 2, 1}, {3, 4, 5}}));
}

TEST(Gltf, WithoutAScenePlacesEveryRootNode) {
  GltfDraft draft = one_triangle();
  draft.add_node({{"mesh", 0}, {"children", {2}}});
  draft.add_node({{"mesh", 0}});
  draft.add_node({{"mesh", 0}});
  EXPECT_EQ(import_glb(draft).triangles.size(), 3U);
}

TEST(Gltf, PlacesTheDefaultSceneOnly) {
  GltfDraft draft = one_triangle();
  draft.add_node({{"mesh", 0}});
  draft.add_node({{"mesh", 0}, {"translation", {5, 0, 0}}});
  draft.json["scenes"] = {{{"nodes", {0}}}, {{"nodes", {1}}}};
  draft.json["scene"] = 1;
  const TriangleMesh mesh = import_glb(draft);
  ASSERT_EQ(mesh.positions.size(), 3U);
  EXPECT_EQ(mesh.positions[0], glm::dvec3(5, 0, 0));
}

TEST(Gltf, ReadsStripsFansAndPrimitivesWithoutIndices) {
  const TriangleMesh square{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, {}};
  const std::vector<std::pair<int, std::vector<Triangle>>> modes = {
      {4, {{0, 1, 2}}}, {5, {{0, 1, 2}, {1, 3, 2}}}, {6, {{1, 2, 0}, {2, 3, 0}}}};
  for (const auto& [mode, triangles] : modes) {
    for (const int index_type : {0, 5121, 5123, 5125}) {
      GltfDraft draft;
      json primitive = {{"mode", mode}, {"attributes", {{"POSITION", draft.add_positions(square)}}}};
      if (index_type != 0) primitive["indices"] = draft.add_indices({0, 1, 2, 3}, index_type);
      draft.add_node({{"mesh", draft.add_mesh(primitive)}});
      EXPECT_EQ(import_glb(draft).triangles, triangles) << "mode " << mode << ", indices " << index_type;
    }
  }
}

TEST(Gltf, ReadsInterleavedQuantisedAndSparsePositions) {
  GltfDraft draft;
  std::string bytes;
  for (const std::int16_t x : {0, 0, 0, 77, 32767, 0, 0, 77, 0, -32768, 0, 77}) {
    bytes.append(reinterpret_cast<const char*>(&x), sizeof x);
  }
  const int view = draft.add_view(bytes);
  draft.json["bufferViews"][static_cast<std::size_t>(view)]["byteStride"] = 8;
  const int positions = draft.add_accessor(view, 5122, "VEC3", 3);
  draft.json["accessors"].back()["normalized"] = true;
  const float moved[] = {7, 8, 9};
  const int values = draft.add_view(std::string(reinterpret_cast<const char*>(moved), sizeof moved));
  const int places = draft.add_view(std::string("\1", 1));
  const int sparse = draft.add_accessor(-1, 5126, "VEC3", 3);
  draft.json["accessors"].back()["sparse"] = {{"count", 1},
                                              {"indices", {{"bufferView", places}, {"componentType", 5121}}},
                                              {"values", {{"bufferView", values}}}};
  draft.json["extensionsRequired"] = {"KHR_mesh_quantization"};
  draft.add_node({{"mesh", draft.add_mesh({{"attributes", {{"POSITION", positions}}}})}});
  draft.add_node({{"mesh", draft.add_mesh({{"attributes", {{"POSITION", sparse}}}})}});
  EXPECT_EQ(import_glb(draft).positions,
            (std::vector<glm::dvec3>{{0, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 0, 0}, {7, 8, 9}, {0, 0, 0}}));
}

TEST(Gltf, PrimitivesMayShareAnAccessor) {
  GltfDraft draft;
  const int positions = draft.add_positions(make_grid(1, 1));
  const int first = draft.add_indices({0, 1, 3}, 5125);
  const int second = draft.add_indices({0, 3, 2}, 5125);
  const json attributes = {{"POSITION", positions}};
  draft.add_mesh({{"attributes", attributes}, {"indices", first}});
  draft.json["meshes"][0]["primitives"].push_back({{"attributes", attributes}, {"indices", second}});
  draft.json["meshes"][0]["primitives"].push_back({{"attributes", attributes}, {"mode", 0}});
  draft.add_node({{"mesh", 0}});
  const Result<ImportedMesh> imported = import_mesh_from_memory(draft.as_glb(), "a.glb");
  ASSERT_TRUE(imported) << imported.error().message;
  EXPECT_EQ(imported->mesh.positions.size(), 4U);
  EXPECT_EQ(imported->mesh.triangles.size(), 2U);
  EXPECT_EQ(imported->warnings,
            std::vector<std::string>{"1 primitives of points, lines or without positions were ignored."});
}

TEST(Gltf, ImagesAndMaterialsAreNeitherReadNorChecked) {
  GltfDraft draft = one_triangle();
  draft.json["images"] = {{{"uri", "/etc/passwd"}}, {{"bufferView", 4711}}, 12};
  draft.json["materials"] = "not even a list";
  draft.json["textures"] = {{{"source", -9}}};
  draft.json["animations"] = {{{"channels", "x"}}};
  draft.add_node({{"mesh", 0}, {"extras", {{"a", {1, 2, 3}}}}, {"name", "n"}});
  EXPECT_EQ(import_glb(draft).triangles.size(), 1U);
}

TEST(Gltf, DeeplyNestedJsonDoesNotOverflowTheStack) {
  const std::string open(2'000'000, '[');
  const std::string close(2'000'000, ']');
  for (const std::string& text :
       {"{\"asset\":{\"version\":\"2.0\"},\"extensions\":" + open + close + "}", open, open + close,
        "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"extensions\":{\"x\":" + open + close + "}}]}"}) {
    EXPECT_FALSE(import_mesh_from_memory(text, "deep.gltf"));
  }
}

TEST(Gltf, CyclesAndSharedNodesAreErrors) {
  GltfDraft cycle = one_triangle();
  cycle.add_node({{"children", {1}}});
  cycle.add_node({{"children", {0}}, {"mesh", 0}});
  cycle.use_scene({0});
  EXPECT_EQ(error_of(cycle), "a.glb: node 0 is in the scene twice, or is its own ancestor");
  GltfDraft diamond = one_triangle();
  diamond.add_node({{"children", {2}}});
  diamond.add_node({{"children", {2}}});
  diamond.add_node({{"mesh", 0}});
  diamond.use_scene({0, 1});
  EXPECT_EQ(error_of(diamond), "a.glb: node 2 is in the scene twice, or is its own ancestor");
}

TEST(Gltf, EveryReferenceIsChecked) {
  const auto broken = [](const char* path, const json& value) {
    GltfDraft draft = gltf_draft(make_tetrahedron());
    draft.json[json::json_pointer(path)] = value;
    return error_of(draft);
  };
  const json numbers[] = {99, -7, 2147483647, 4294967295U, 1e300, 18446744073709551615U, "x", nullptr, json::array()};
  for (const char* path : {"/scenes/0/nodes/0",
                           "/nodes/0/mesh",
                           "/meshes/0/primitives/0/attributes/POSITION",
                           "/meshes/0/primitives/0/indices",
                           "/accessors/0/bufferView",
                           "/accessors/0/count",
                           "/accessors/1/count",
                           "/accessors/0/byteOffset",
                           "/accessors/0/componentType",
                           "/accessors/1/type",
                           "/bufferViews/0/buffer",
                           "/bufferViews/0/byteOffset",
                           "/bufferViews/0/byteLength",
                           "/bufferViews/0/byteStride",
                           "/meshes/0/primitives",
                           "/nodes/0",
                           "/nodes/0/translation",
                           "/nodes/0/matrix",
                           "/scene",
                           "/asset/version"}) {
    for (const json& value : numbers) {
      SCOPED_TRACE(std::string(path) + " = " + value.dump());
      const std::string error = broken(path, value);
      EXPECT_TRUE(error == "no error" || error.starts_with("a.glb: ")) << error;
    }
  }
  EXPECT_EQ(broken("/nodes/0/mesh", 5), "a.glb: node 0 names mesh 5, which does not exist");
  EXPECT_EQ(broken("/scenes/0/nodes/0", 5), "a.glb: the scene names node 5, which does not exist");
  EXPECT_EQ(broken("/bufferViews/0/byteLength", 4000),
            "a.glb: mesh 0, primitive 0: bufferView 0 covers bytes 0 to 4000, but buffer 0 has 96");
  EXPECT_EQ(broken("/nodes/0/matrix", {1, 2, 3}), "a.glb: node 0 has a transform of the wrong length");
}

TEST(Gltf, UnknownRequiredExtensionsAreUnsupported) {
  GltfDraft draft = gltf_draft(make_tetrahedron());
  draft.json["extensionsRequired"] = {"KHR_materials_unlit", "KHR_texture_transform"};
  EXPECT_EQ(error_of(draft), "no error");
  draft.json["extensionsRequired"].push_back("EXT_meshopt_compression");
  const Result<ImportedMesh> imported = import_mesh_from_memory(draft.as_glb(), "a.glb");
  ASSERT_FALSE(imported);
  EXPECT_EQ(imported.error().kind, ErrorKind::unsupported);
  EXPECT_EQ(imported.error().message,
            "a.glb: requires the glTF extension 'EXT_meshopt_compression', which cannot be read: export without it");
}

TEST(Gltf, ManyInstancesOfALargeMeshStopAtTheLimit) {
  GltfDraft draft = gltf_draft(make_sphere(20, 20));
  std::vector<int> nodes = {0};
  for (int i = 0; i < 400; ++i) nodes.push_back(draft.add_node({{"mesh", 0}}));
  draft.use_scene(nodes);
  ImportOptions options;
  options.max_placed_elements = 100'000;
  EXPECT_NE(error_of(draft, options).find("more than is allowed for this file"), std::string::npos);
  EXPECT_EQ(import_glb(draft).triangles.size(), 401 * make_sphere(20, 20).triangles.size());
}

TEST(Gltf, ManyPrimitivesOfOneAccessorStopAtTheLimit) {
  GltfDraft draft = gltf_draft(make_sphere(20, 20));
  const json primitive = draft.json["meshes"][0]["primitives"][0];
  for (int i = 0; i < 400; ++i) draft.json["meshes"][0]["primitives"].push_back(primitive);
  ImportOptions options;
  options.max_placed_elements = 100'000;
  EXPECT_NE(error_of(draft, options).find("more vertices or triangles than is allowed for this file"),
            std::string::npos);
}

TEST(Gltf, ExternalBuffersAreReadFromTheFolderOfTheFileOnly) {
  TemporaryFolder folder;
  const GltfDraft draft = gltf_draft(make_tetrahedron());
  folder.write("secret.bin", draft.binary);
  folder.write("models/mesh.bin", draft.binary);
  folder.write("models/parts/my mesh.bin", draft.binary);
  std::filesystem::create_symlink(folder.path() / "secret.bin", folder.path() / "models/link.bin");
  const auto import = [&](const std::string& uri) {
    return import_mesh(folder.write("models/mesh.gltf", draft.as_gltf_with_uri(uri)));
  };
  for (const char* uri : {"mesh.bin", "./mesh.bin", "parts/my%20mesh.bin", "parts/../mesh.bin"}) {
    const Result<ImportedMesh> imported = import(uri);
    ASSERT_TRUE(imported) << imported.error().message;
    EXPECT_EQ(imported->mesh.triangles.size(), 4U);
  }
  for (const std::string& uri :
       {std::string("../secret.bin"), (folder.path() / "secret.bin").string(), std::string("link.bin"),
        std::string("parts/../../secret.bin"), std::string("%2e%2e/secret.bin")}) {
    const Result<ImportedMesh> imported = import(uri);
    ASSERT_FALSE(imported) << uri;
    EXPECT_NE(imported.error().message.find("leads out of the model's folder"), std::string::npos)
        << imported.error().message;
  }
  for (const char* uri :
       {"file:///etc/passwd", "http://example.org/mesh.bin", "..\\secret.bin", "", "mesh%00.bin", "%zz"}) {
    EXPECT_EQ(import(uri).error().kind, ErrorKind::bad_input) << uri;
  }
  EXPECT_EQ(import("missing.bin").error().kind, ErrorKind::not_found);
  EXPECT_EQ(import("parts").error().kind, ErrorKind::io);
  folder.write("models/short.bin", draft.binary.substr(0, draft.binary.size() - 1));
  EXPECT_NE(import("short.bin").error().message.find("buffer 0 claims 96 bytes, but holds 95"), std::string::npos);
}

TEST(Gltf, DracoDataThatClaimsTooMuchOrNamesNothingIsRefused) {
  const GltfDraft draft = draco_gltf_draft(make_sphere(9, 14), false);
  const auto with = [&](const char* path, const json& value) {
    GltfDraft changed = draft;
    changed.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"][json::json_pointer(path)] =
        value;
    return error_of(changed);
  };
  EXPECT_EQ(with("/bufferView", 3), "a.glb: bufferView 3 does not exist");
  EXPECT_NE(with("/attributes/POSITION", 77).find("has no attribute 77"), std::string::npos);
  EXPECT_NE(with("/attributes", 5).find("names no bufferView or no POSITION"), std::string::npos);
  GltfDraft huge = draft;
  ASSERT_TRUE(huge.binary.starts_with("DRACO"));
  huge.binary.replace(12, 10, "\xFF\xFF\xFF\xFF\x0F\xFF\xFF\xFF\xFF\x0F", 10);
  EXPECT_NE(error_of(huge).find("claims 4294967295 faces"), std::string::npos) << error_of(huge);
}

TEST(Gltf, DracoPositionsAreWithinTheQuantisationStep) {
  const TriangleMesh sphere = in_float_precision(make_sphere(9, 14));
  const TriangleMesh mesh = import_glb(draco_gltf_draft(sphere, false));
  ASSERT_EQ(mesh.positions.size(), sphere.positions.size());
  for (const glm::dvec3& p : mesh.positions) {
    double nearest = 1e9;
    for (const glm::dvec3& q : sphere.positions) {
      nearest = std::min(nearest, std::max({std::abs(p.x - q.x), std::abs(p.y - q.y), std::abs(p.z - q.z)}));
    }
    EXPECT_LE(nearest, 2.0 / 16383 / 2 * 1.01);
  }
}

TEST(Gltf, VersionOneIsUnsupported) {
  for (const std::string version : {R"("1.0")", R"("1.1")", "1", "1.0"}) {
    SCOPED_TRACE(version);
    const auto imported = import_mesh_from_memory(
        R"({"asset":{"version":)" + version + R"(},"buffers":{"a":{"byteLength":3}}})", "a.gltf");
    ASSERT_FALSE(imported);
    EXPECT_EQ(imported.error().kind, ErrorKind::unsupported);
    EXPECT_NE(imported.error().message.find("glTF version 1"), std::string::npos) << imported.error().message;
  }
}

TEST(Gltf, GlbVersionOneIsUnsupported) {
  std::string bytes = gltf_draft(make_tetrahedron()).as_glb();
  bytes[4] = 1;
  EXPECT_EQ(import_mesh_from_memory(bytes, "a.glb").error().kind, ErrorKind::unsupported);
}

}  // namespace
}  // namespace fanstream
