// Level files with texture coordinates and colours, read back by the importers.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "client/export/mesh_export.h"
#include "client/reduce/mesh_reduction.h"
#include "common/import/mesh_import.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

std::string file_name(const std::string& extension) { return std::string("a").append(extension); }

struct Sample {
  TriangleMesh mesh = testing::make_grid(5, 4);
  VertexAttributes attributes;
  Sample() {
    for (const glm::dvec3& p : mesh.positions) {
      attributes.texture_coordinates.emplace_back(static_cast<float>(0.1 * p.x), static_cast<float>(0.3 + 0.1 * p.y));
      const auto byte = [](double x) { return static_cast<float>(x); };
      attributes.colors.emplace_back(byte(0.2 * p.x), byte(0.25 * p.y), 0.5F, 1.0F);
    }
  }
};

ImportedMesh written_and_read(const Sample& sample, const std::string& extension) {
  const auto bytes = encode_mesh(sample.mesh.positions, sample.mesh.triangles,
                                 mesh_file_format(file_name(extension)).value(), sample.attributes);
  EXPECT_TRUE(bytes) << bytes.error().message;
  ImportOptions options;
  options.keep_attributes = true;
  const std::string text(bytes->begin(), bytes->end());
  auto imported = import_mesh_from_memory(text, file_name(extension), options);
  EXPECT_TRUE(imported) << imported.error().message;
  return imported ? std::move(*imported) : ImportedMesh{};
}

TEST(AttributeExport, EveryFormatGivesBackWhatItCanHold) {
  const Sample sample;
  const std::map<std::string, float> color_error{{".ply", 0.006F}, {".obj", 1e-5F}, {".glb", 1e-5F}};
  for (const auto& [extension, error] : color_error) {
    const ImportedMesh read = written_and_read(sample, extension);
    ASSERT_EQ(read.mesh.triangles.size(), sample.mesh.triangles.size()) << extension;
    for (std::size_t t = 0; t < read.mesh.triangles.size(); ++t) {
      for (std::size_t i = 0; i < 3; ++i) {
        const VertexId is = read.mesh.triangles[t][i];
        const VertexId was = sample.mesh.triangles[t][i];
        ASSERT_EQ(read.mesh.positions[is], sample.mesh.positions[was]) << extension;
        EXPECT_NEAR(read.attributes.texture_coordinates[is].x, sample.attributes.texture_coordinates[was].x, 1e-7);
        EXPECT_NEAR(read.attributes.texture_coordinates[is].y, sample.attributes.texture_coordinates[was].y, 1e-7);
        for (int c = 0; c < 4; ++c) {
          EXPECT_NEAR(read.attributes.colors[is][c], sample.attributes.colors[was][c], error) << extension;
        }
      }
    }
  }
}

TEST(AttributeExport, AFileWithoutAttributesIsAsBefore) {
  const Sample sample;
  for (const char* extension : {".ply", ".obj", ".glb"}) {
    const MeshFileFormat format = mesh_file_format(file_name(extension)).value();
    const auto without = encode_mesh(sample.mesh.positions, sample.mesh.triangles, format);
    const auto with = encode_mesh(sample.mesh.positions, sample.mesh.triangles, format, sample.attributes);
    EXPECT_LT(without->size(), with->size());
    const auto read = import_mesh_from_memory(std::string(without->begin(), without->end()), file_name(extension));
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_TRUE(read->attributes.empty());
    EXPECT_EQ(read->mesh.positions, sample.mesh.positions);
  }
}

TEST(AttributeExport, ListsOfTheWrongLengthAreRefused) {
  Sample sample;
  sample.attributes.colors.pop_back();
  const auto bytes = encode_mesh(sample.mesh.positions, sample.mesh.triangles, MeshFileFormat::glb, sample.attributes);
  ASSERT_FALSE(bytes);
  EXPECT_EQ(bytes.error().kind, ErrorKind::bad_input);
  EXPECT_NE(bytes.error().message.find("29 attributes for 30 vertices"), std::string::npos) << bytes.error().message;
}

}  // namespace
}  // namespace fanstream
