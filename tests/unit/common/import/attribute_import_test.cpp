// Texture coordinates and colours, as far as files carry them.
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <gtest/gtest.h>

#include <cstring>
#include <set>

#include "common/import/attribute_lists.h"
#include "common/import/attribute_transfer.h"
#include "common/import/mesh_cleaner.h"
#include "common/import/mesh_import.h"
#include "common/mesh/srgb.h"
#include "tests/support/mesh_files.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/shared_data.h"

namespace fanstream {
namespace {

ImportedMesh import_text(const std::string& text, const std::string& name, bool keep = true) {
  ImportOptions options;
  options.keep_attributes = keep;
  auto imported = import_mesh_from_memory(text, name, options);
  EXPECT_TRUE(imported) << imported.error().message;
  return imported ? std::move(*imported) : ImportedMesh{};
}

// The attributes of the vertex at this place; the place must have exactly one.
std::size_t vertex_at(const ImportedMesh& imported, const glm::dvec3& place) {
  std::size_t found = imported.mesh.positions.size();
  for (std::size_t v = 0; v < imported.mesh.positions.size(); ++v) {
    if (imported.mesh.positions[v] != place) continue;
    EXPECT_EQ(found, imported.mesh.positions.size()) << "there are two";
    found = v;
  }
  EXPECT_LT(found, imported.mesh.positions.size());
  return found;
}

void expect_near(const glm::dvec2& uv, double u, double v) {
  EXPECT_NEAR(uv.x, u, 1e-7);
  EXPECT_NEAR(uv.y, v, 1e-7);
}
void expect_near(const glm::vec4& c, float r, float g, float b, float a) {
  EXPECT_NEAR(c.r, r, 1e-5F);
  EXPECT_NEAR(c.g, g, 1e-5F);
  EXPECT_NEAR(c.b, b, 1e-5F);
  EXPECT_NEAR(c.a, a, 1e-5F);
}

const char* const kTwoCharts =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
    "vt 0 0\nvt 0.5 0\nvt 0.5 0.25\n"
    "f 1/1 2/2 3/3\n"
    "f 1/4/1 3/-3 4/6\n"  // the fourth comes later; -3 is the first of the three so far
    "vt 1 1\nvt 0.75 1\nvt 0.75 0.5\n";

TEST(AttributeImport, ObjCornersWithSeveralCoordinatesBecomeWedges) {
  const ImportedMesh imported = import_text(kTwoCharts, "a.obj");
  ASSERT_EQ(imported.mesh.positions.size(), 6U) << "1 and 3 have two each";
  ASSERT_EQ(imported.attributes.texture_coordinates.size(), 6U);
  EXPECT_TRUE(imported.attributes.colors.empty());
  const auto uv = [&](std::size_t t, std::size_t k) {
    return imported.attributes.texture_coordinates[imported.mesh.triangles[t][k]];
  };
  expect_near(uv(0, 0), 0.0, 1.0);  // v runs down here, up there
  expect_near(uv(0, 1), 0.5, 1.0);
  expect_near(uv(0, 2), 0.5, 0.75);
  expect_near(uv(1, 0), 1.0, 0.0);
  expect_near(uv(1, 1), 0.0, 1.0);
  expect_near(uv(1, 2), 0.75, 0.5);
  EXPECT_EQ(imported.mesh.positions[imported.mesh.triangles[1][1]], glm::dvec3(1, 1, 0));
}

TEST(AttributeImport, ObjWithoutTheOptionIsAsItWas) {
  const ImportedMesh imported = import_text(kTwoCharts, "a.obj", false);
  EXPECT_EQ(imported.mesh.positions.size(), 4U);
  EXPECT_TRUE(imported.attributes.empty());
  const Triangle first{0, 1, 2}, second{0, 2, 3};
  EXPECT_EQ(imported.mesh.triangles, (std::vector<Triangle>{first, second}));
}

TEST(AttributeImport, ObjPolygonsColoursAndOddCornersAreKept) {
  const ImportedMesh imported = import_text(
      "v 0 0 0 1 0 0\nv 2 0 0 0 1 0\nv 2 2 0 0 0 1\nv 0 2 0\nvt 0.25\nvt 0.5 0.5 0.1\n"
      "f 1/1 2/2 3//4 4/9\n",
      "a.obj");
  ASSERT_EQ(imported.mesh.triangles.size(), 2U);
  ASSERT_EQ(imported.attributes.colors.size(), 4U);
  expect_near(imported.attributes.colors[vertex_at(imported, {0, 0, 0})], 1, 0, 0, 1);
  expect_near(imported.attributes.colors[vertex_at(imported, {2, 2, 0})], 0, 0, 1, 1);
  expect_near(imported.attributes.colors[vertex_at(imported, {0, 2, 0})], 1, 1, 1, 1);
  expect_near(imported.attributes.texture_coordinates[vertex_at(imported, {0, 0, 0})], 0.25, 1.0);
  expect_near(imported.attributes.texture_coordinates[vertex_at(imported, {2, 0, 0})], 0.5, 0.5);
  expect_near(imported.attributes.texture_coordinates[vertex_at(imported, {2, 2, 0})], 0.0, 0.0);
  ASSERT_EQ(imported.warnings.size(), 1U);
  EXPECT_NE(imported.warnings[0].find("1 corners name texture coordinates"), std::string::npos);
}

TEST(AttributeImport, LimitsHoldForWedgesToo) {
  ImportOptions options;
  options.keep_attributes = true;
  options.max_vertices = 5;
  const auto obj = import_mesh_from_memory(kTwoCharts, "a.obj", options);
  ASSERT_FALSE(obj);
  EXPECT_EQ(obj.error().kind, ErrorKind::limit) << obj.error().message;
  options.max_vertices = 100;
  options.max_triangles = 1;
  const auto many = import_mesh_from_memory(kTwoCharts, "a.obj", options);
  ASSERT_FALSE(many);
  EXPECT_EQ(many.error().kind, ErrorKind::limit) << many.error().message;
}

TEST(AttributeImport, PlyVerticesCarryColoursAndCoordinates) {
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty uchar red\nproperty float y\nproperty float "
      "z\n"
      "property uchar green\nproperty uchar blue\nproperty float nx\nproperty float s\nproperty float t\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const ImportedMesh imported = import_text(
      header + "0 255 0 0 0 128 9 0.25 0.75\n1 0 0 0 255 0 9 0.5 0\n0 0 1 0 0 255 9 1 1\n3 0 1 2\n", "a.ply");
  ASSERT_EQ(imported.attributes.colors.size(), 3U);
  expect_near(imported.attributes.colors[0], 1, 0, linear_of_srgb(128.0F / 255.0F), 1);
  expect_near(imported.attributes.colors[1], 0, 1, 0, 1);
  expect_near(imported.attributes.texture_coordinates[0], 0.25, 0.25);
  EXPECT_EQ(imported.mesh.positions[2], glm::dvec3(0, 1, 0));
  EXPECT_TRUE(import_text(header + "0 255 0 0 0 128 9 0.25 0.75\n1 0 0 0 255 0 9 0.5 0\n0 0 1 0 0 255 9 1 1\n3 0 1 2\n",
                          "a.ply", false)
                  .attributes.empty());
}

TEST(AttributeImport, PlyFacesCarryCoordinatesOfTheirCorners) {
  const std::string text =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n"
      "0 0 0 255 0 0\n1 0 0 0 255 0\n1 1 0 0 0 255\n0 1 0 255 255 255\n"
      "3 0 1 2 6 0 0 0.5 0 0.5 0.25\n3 0 2 3 6 1 1 0.5 0.25 0 1\n";
  const ImportedMesh imported = import_text(text, "a.ply");
  ASSERT_EQ(imported.mesh.positions.size(), 5U) << "one corner of the first vertex differs";
  ASSERT_EQ(imported.attributes.texture_coordinates.size(), 5U);
  ASSERT_EQ(imported.attributes.colors.size(), 5U);
  const Triangle& second = imported.mesh.triangles[1];
  EXPECT_EQ(second[1], imported.mesh.triangles[0][2]);
  EXPECT_NE(second[0], imported.mesh.triangles[0][0]);
  EXPECT_EQ(imported.mesh.positions[second[0]], glm::dvec3(0));
  expect_near(imported.attributes.texture_coordinates[second[0]], 1.0, 0.0);
  expect_near(imported.attributes.colors[second[0]], 1, 0, 0, 1);
  EXPECT_EQ(import_text(text, "a.ply", false).mesh.positions.size(), 4U);
  ImportOptions options;
  options.keep_attributes = true;
  options.max_vertices = 4;
  EXPECT_EQ(import_mesh_from_memory(text, "a.ply", options).error().kind, ErrorKind::limit);
  const auto cut = import_mesh_from_memory(text.substr(0, text.size() - 8), "a.ply", options);
  EXPECT_EQ(cut.error().kind, ErrorKind::bad_input);
}

TEST(AttributeImport, OffColoursAreWholeNumbersOrFractions) {
  const ImportedMesh whole =
      import_text("COFF\n3 1 0\n0 0 0 255 0 0 51\n1 0 0 0 255 0 255\n0 1 0 0 0 128\n3 0 1 2\n", "a.off");
  ASSERT_EQ(whole.attributes.colors.size(), 3U);
  expect_near(whole.attributes.colors[0], 1, 0, 0, 0.2F);
  expect_near(whole.attributes.colors[2], 0, 0, linear_of_srgb(128.0F / 255.0F), 1);
  const ImportedMesh fractions = import_text(
      "STCNOFF\n3 1 0\n0 0 0 0 0 1 0.5 0 0 1 0.1 0.2\n1 0 0 0 0 1 0 1 0 1 0.3 0.4\n0 1 0 0 0 1 0 0 1 1 1 1\n3 0 1 2\n",
      "a.off");
  expect_near(fractions.attributes.colors[0], linear_of_srgb(0.5F), 0, 0, 1);
  expect_near(fractions.attributes.texture_coordinates[1], 0.3, 0.6);
  EXPECT_TRUE(import_text("OFF\n3 1 0\n0 0 0 1 2 3\n1 0 0\n0 1 0\n3 0 1 2\n", "a.off").attributes.empty());
}

std::string floats(const std::vector<float>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)};
}

TEST(AttributeImport, GltfPrimitivesWithAndWithoutAttributesShareOneScene) {
  TriangleMesh triangle;
  triangle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  triangle.triangles = {{0, 1, 2}};
  testing::GltfDraft draft;
  const int positions = draft.add_positions(triangle);
  const int indices = draft.add_indices({0, 1, 2}, 5121);
  const int uv = draft.add_accessor(draft.add_view(floats({0, 0, 0.5F, 0, 0.25F, 1})), 5126, "VEC2", 3);
  const int other_uv = draft.add_accessor(draft.add_view(floats({1, 1, 1, 1, 1, 1})), 5126, "VEC2", 3);
  const std::string colors{"\xFF\x00\x80\x00\x00\xFF\x00\x00\x00\x00\xFF\x00", 12};  // three bytes a vertex, padded
  const int view = draft.add_view(colors);
  draft.json["bufferViews"][static_cast<std::size_t>(view)]["byteStride"] = 4;
  const int color = draft.add_accessor(view, 5121, "VEC3", 3);
  draft.json["accessors"][static_cast<std::size_t>(color)]["normalized"] = true;
  const auto primitive = [&](nlohmann::json attributes) {
    attributes["POSITION"] = positions;
    return nlohmann::json{{"attributes", attributes}, {"indices", indices}};
  };
  const int mesh = draft.add_mesh(primitive({{"TEXCOORD_0", uv}}));
  draft.json["meshes"][0]["primitives"].push_back(primitive({{"TEXCOORD_0", other_uv}, {"COLOR_0", color}}));
  draft.json["meshes"][0]["primitives"].push_back(primitive(nlohmann::json::object()));
  draft.add_node({{"mesh", mesh}});
  draft.add_node({{"mesh", mesh}, {"translation", {5, 0, 0}}});
  draft.use_scene({0, 1});
  const ImportedMesh imported = import_text(draft.as_glb(), "a.glb");
  ASSERT_EQ(imported.mesh.positions.size(), 18U) << "the positions' accessor is shared, the attributes are not";
  ASSERT_EQ(imported.attributes.texture_coordinates.size(), 18U);
  ASSERT_EQ(imported.attributes.colors.size(), 18U);
  for (const std::size_t node : {0U, 9U}) {
    expect_near(imported.attributes.texture_coordinates[node + 2], 0.25, 1.0);
    expect_near(imported.attributes.texture_coordinates[node + 4], 1.0, 1.0);
    expect_near(imported.attributes.texture_coordinates[node + 7], 0.0, 0.0);
    expect_near(imported.attributes.colors[node + 1], 1, 1, 1, 1);
    expect_near(imported.attributes.colors[node + 3], 1, 0, 128.0F / 255.0F, 1);
    expect_near(imported.attributes.colors[node + 8], 1, 1, 1, 1);
  }
  const ImportedMesh plain = import_text(draft.as_glb(), "a.glb", false);
  EXPECT_EQ(plain.mesh.positions.size(), 6U);
  EXPECT_TRUE(plain.attributes.empty());
}

TEST(AttributeImport, GltfAttributesThatDoNotFitAreNamed) {
  TriangleMesh triangle;
  triangle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  triangle.triangles = {{0, 1, 2}};
  const auto complaint = [&](const std::string& type, std::size_t count) {
    testing::GltfDraft draft;
    const int uv = draft.add_accessor(draft.add_view(floats(std::vector<float>(12, 0.5F))), 5126, type, count);
    draft.add_node(
        {{"mesh", draft.add_mesh({{"attributes", {{"POSITION", draft.add_positions(triangle)}, {"TEXCOORD_0", uv}}},
                                  {"indices", draft.add_indices({0, 1, 2}, 5121)}})}});
    draft.use_scene({0});
    ImportOptions options;
    options.keep_attributes = true;
    const auto imported = import_mesh_from_memory(draft.as_glb(), "a.glb", options);
    EXPECT_TRUE(import_mesh_from_memory(draft.as_glb(), "a.glb")) << "nobody asked for them";
    return imported ? std::string() : imported.error().message;
  };
  EXPECT_EQ(complaint("VEC2", 3), "");
  EXPECT_NE(complaint("VEC2", 2).find("3 positions, but 2 values in accessor 0"), std::string::npos);
  EXPECT_NE(complaint("VEC3", 3).find("accessor 0 has the wrong number of components"), std::string::npos);
  EXPECT_NE(complaint("VEC2", 7).find("truncated or damaged"), std::string::npos);
}

TEST(AttributeImport, DracoCarriesAttributesAsPlainGltfDoes) {
  const TriangleMesh grid = testing::make_grid(6, 4);
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(static_cast<int>(grid.triangles.size()));
  const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int texture = builder.AddAttribute(draco::GeometryAttribute::TEX_COORD, 2, draco::DT_FLOAT32);
  const int color = builder.AddAttribute(draco::GeometryAttribute::COLOR, 4, draco::DT_UINT8, true);
  using Byte4 = std::array<std::uint8_t, 4>;
  const auto color_of = [](const glm::dvec3& p) {
    return Byte4{static_cast<std::uint8_t>(40 * p.x), static_cast<std::uint8_t>(60 * p.y), 7, 255};
  };
  for (std::size_t i = 0; i < grid.triangles.size(); ++i) {
    std::array<glm::vec3, 3> points;
    std::array<glm::vec2, 3> coordinates;
    std::array<Byte4, 3> colors;
    for (std::size_t k = 0; k < 3; ++k) {
      points[k] = glm::vec3(grid.positions[grid.triangles[i][k]]);
      // A seam at x = 3: the right half has coordinates of its own.
      const bool right = grid.positions[grid.triangles[i][0]].x + grid.positions[grid.triangles[i][1]].x +
                             grid.positions[grid.triangles[i][2]].x >
                         9.0;
      coordinates[k] = {0.125F * points[k].x + (right ? 10.0F : 0.0F), 0.25F * points[k].y};
      colors[k] = color_of(grid.positions[grid.triangles[i][k]]);
    }
    const draco::FaceIndex face(static_cast<std::uint32_t>(i));
    builder.SetAttributeValuesForFace(position, face, &points[0], &points[1], &points[2]);
    builder.SetAttributeValuesForFace(texture, face, &coordinates[0], &coordinates[1], &coordinates[2]);
    builder.SetAttributeValuesForFace(color, face, &colors[0], &colors[1], &colors[2]);
  }
  const std::unique_ptr<draco::Mesh> source = builder.Finalize();
  draco::Encoder encoder;
  encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
  draco::EncoderBuffer encoded;
  ASSERT_TRUE(encoder.EncodeMeshToBuffer(*source, &encoded).ok());
  testing::GltfDraft draft;
  const int view = draft.add_view({encoded.data(), encoded.size()});
  const auto count = source->num_points();
  const nlohmann::json accessors = {{"POSITION", draft.add_accessor(-1, 5126, "VEC3", count)},
                                    {"TEXCOORD_0", draft.add_accessor(-1, 5126, "VEC2", count)},
                                    {"COLOR_0", draft.add_accessor(-1, 5121, "VEC4", count)}};
  draft.json["accessors"].back()["normalized"] = true;
  const nlohmann::json ids = {{"POSITION", source->attribute(position)->unique_id()},
                              {"TEXCOORD_0", source->attribute(texture)->unique_id()},
                              {"COLOR_0", source->attribute(color)->unique_id()}};
  draft.json["extensionsUsed"] = draft.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  draft.add_node(
      {{"mesh", draft.add_mesh(
                    {{"attributes", accessors},
                     {"extensions", {{"KHR_draco_mesh_compression", {{"bufferView", view}, {"attributes", ids}}}}}})}});
  draft.use_scene({0});
  const ImportedMesh imported = import_text(draft.as_glb(), "a.glb");
  ASSERT_EQ(imported.mesh.triangles.size(), grid.triangles.size());
  ASSERT_EQ(imported.attributes.texture_coordinates.size(), imported.mesh.positions.size());
  ASSERT_EQ(imported.attributes.colors.size(), imported.mesh.positions.size());
  EXPECT_EQ(imported.mesh.positions.size(), grid.positions.size() + 5) << "the seam's five vertices are there twice";
  for (std::size_t v = 0; v < imported.mesh.positions.size(); ++v) {
    const glm::dvec3& p = imported.mesh.positions[v];
    const glm::dvec2& uv = imported.attributes.texture_coordinates[v];
    EXPECT_NEAR(uv.x - (uv.x > 5.0 ? 10.0 : 0.0), 0.125 * p.x, 1e-6);
    EXPECT_NEAR(uv.y, 0.25 * p.y, 1e-6);
    const Byte4 expected = color_of(p);
    expect_near(imported.attributes.colors[v], expected[0] / 255.0F, expected[1] / 255.0F, 7 / 255.0F, 1);
  }
}

TEST(AttributeImport, NumbersThatAreNoneAreReplacedWithAWarning) {
  const ImportedMesh imported = import_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt nan 0\nvt 1 0\nf 1/1 2/2 3/2\n", "a.obj");
  ASSERT_EQ(imported.attributes.texture_coordinates.size(), 3U);
  expect_near(imported.attributes.texture_coordinates[vertex_at(imported, {0, 0, 0})], 0, 0);
  ASSERT_EQ(imported.warnings.size(), 1U);
  EXPECT_NE(imported.warnings[0].find("1 texture coordinates are not finite"), std::string::npos);
}

TEST(AttributeTransfer, CornersKeepTheirAttributesThroughEveryRepair) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    // Everything that is repaired: duplicates, degenerate triangles, turned-over ones, crowded edges.
    const TriangleMesh soup = testing::make_random_soup(14, 60, seed, true);
    VertexAttributes attributes;
    for (std::size_t v = 0; v < soup.positions.size(); ++v) attributes.texture_coordinates.emplace_back(v, 0.0);
    const TriangleMesh cleaned = clean_mesh(soup).mesh;
    const CornerAttributes carried = attributes_after_cleaning(soup, attributes, cleaned);
    ASSERT_EQ(carried.wedges.size(), cleaned.triangles.size());
    std::set<std::multiset<VertexId>> triangles;
    for (const Triangle& t : soup.triangles) triangles.insert({t[0], t[1], t[2]});
    for (std::size_t t = 0; t < cleaned.triangles.size(); ++t) {
      const Triangle& wedges = carried.wedges[t];
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(soup.positions[wedges[i]], cleaned.positions[cleaned.triangles[t][i]]) << "seed " << seed;
      }
      EXPECT_TRUE(triangles.contains({wedges[0], wedges[1], wedges[2]})) << "seed " << seed << ": of one triangle";
    }
  }
}

TEST(AttributeImport, SharedModelsHaveWhatTheirDescriptionSays) {
  const auto path = testing::shared_mesh("spot_textured.glb");
  if (path.empty()) GTEST_SKIP() << "no shared meshes";
  ImportOptions options;
  options.keep_attributes = true;
  const auto spot = import_mesh(path, options);
  ASSERT_TRUE(spot) << spot.error().message;
  EXPECT_EQ(spot->attributes.texture_coordinates.size(), 3225U);
  const auto scallop = import_mesh(testing::shared_mesh("scallop_120k_colour_normals.glb"), options);
  ASSERT_TRUE(scallop) << scallop.error().message;
  EXPECT_EQ(scallop->attributes.colors.size(), 60'002U);
  EXPECT_TRUE(scallop->attributes.texture_coordinates.empty());
}

TEST(Srgb, ThereAndBackGivesEveryByteAgain) {
  for (int byte = 0; byte < 256; ++byte) {
    const float stored = static_cast<float>(byte) / 255.0F;
    EXPECT_EQ(std::lround(255.0F * srgb_of_linear(linear_of_srgb(stored))), byte);
  }
  EXPECT_FLOAT_EQ(linear_of_srgb(1.0F), 1.0F);
}

}  // namespace
}  // namespace fanstream
