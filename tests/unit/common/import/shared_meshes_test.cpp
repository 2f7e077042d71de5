// Every real mesh of ../shared/data imports and cleans to what its README states.
#include <gtest/gtest.h>

#include <algorithm>

#include "common/import/mesh_cleaner.h"
#include "common/import/mesh_import.h"
#include "common/mesh/manifold_check.h"
#include "tests/support/drawn_triangles.h"
#include "tests/support/shared_data.h"

namespace fanstream {
namespace {

using namespace fanstream::testing;

struct Expected {
  const char* file;
  std::size_t raw_vertices;  // as in the file, instances placed
  std::size_t raw_triangles;
  std::size_t raw_components;
  std::size_t vertices;  // once cleaned
  std::size_t triangles;
  std::size_t components;
  std::size_t boundary_edges;
  RepairReport report;
};

void PrintTo(const Expected& expected, std::ostream* stream) { *stream << expected.file; }

std::size_t count_boundary_edges(const TriangleMesh& mesh) {
  std::vector<std::pair<VertexId, VertexId>> edges;
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) edges.push_back(std::minmax(t[k], t[(k + 1) % 3]));
  }
  std::sort(edges.begin(), edges.end());
  std::size_t count = 0;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const bool alone = (i == 0 || edges[i - 1] != edges[i]) && (i + 1 == edges.size() || edges[i + 1] != edges[i]);
    count += alone ? 1 : 0;
  }
  return count;
}

std::size_t components(const TriangleMesh& mesh) { return count_components(mesh.positions.size(), mesh.triangles); }

class SharedMesh : public ::testing::TestWithParam<Expected> {};

TEST_P(SharedMesh, ImportsAndCleansToAnOrientedManifoldThatDrawsTheSame) {
  const Expected& expected = GetParam();
  const std::filesystem::path path = shared_mesh(expected.file);
  if (path.empty()) GTEST_SKIP() << expected.file << " is not in " << shared_data_folder();
  const Result<ImportedMesh> imported = import_mesh(path);
  ASSERT_TRUE(imported) << imported.error().message;
  EXPECT_TRUE(imported->warnings.empty()) << imported->warnings.front();
  EXPECT_EQ(imported->mesh.positions.size(), expected.raw_vertices);
  EXPECT_EQ(imported->mesh.triangles.size(), expected.raw_triangles);
  EXPECT_EQ(components(imported->mesh), expected.raw_components);

  const CleanedMesh cleaned = clean_mesh(imported->mesh);
  std::string why;
  EXPECT_TRUE(is_oriented_manifold(cleaned.mesh, &why)) << why;
  EXPECT_TRUE(drawn_triangles(cleaned.mesh, false) == drawn_triangles(imported->mesh));
  EXPECT_EQ(cleaned.mesh.positions.size(), expected.vertices);
  EXPECT_EQ(cleaned.mesh.triangles.size(), expected.triangles);
  EXPECT_EQ(components(cleaned.mesh), expected.components);
  EXPECT_EQ(count_boundary_edges(cleaned.mesh), expected.boundary_edges);
  const auto counts = named_counts(cleaned.report);
  const auto expected_counts = named_counts(expected.report);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    EXPECT_EQ(counts[i].second, expected_counts[i].second) << counts[i].first;
  }
}

// Where ../shared/data/README.md gives a count, it is the same here (it counts 2,094 non-manifold edges in the small
// dragon before the 1,254 duplicate triangles are dropped, we split 1,677 after).
const Expected kMeshes[] = {
    {"dragon_stanford_full.ply", 437645, 871414, 151, 435545, 871306, 1, 0, {2100, 0, 108, 0, 0, 0, 0}},
    {"armadillo_86k.ply", 43243, 86482, 1, 43243, 86482, 1, 0, {0, 0, 0, 0, 0, 0, 0}},
    {"stanford_bunny_zipper.ply", 35947, 69451, 1114, 34834, 69451, 1, 223, {0, 1113, 0, 0, 0, 0, 0}},
    {"skull_100k_genus2.ply", 49999, 100002, 1, 49999, 100002, 1, 0, {0, 0, 0, 0, 0, 0, 0}},
    {"boot_40k_genus12.ply", 19931, 39906, 1, 19931, 39906, 1, 0, {0, 0, 0, 0, 0, 0, 0}},
    {"mountain_terrain_51k_open.ply", 25600, 50562, 1, 25600, 50562, 1, 636, {0, 0, 0, 0, 0, 0, 0}},
    {"fandisk_13k.obj", 6475, 12946, 1, 6475, 12946, 1, 0, {0, 0, 0, 0, 0, 0, 0}},
    {"cow_2904v.off", 2904, 5804, 1, 2904, 5804, 1, 0, {1, 0, 0, 0, 0, 0, 1}},
    {"sheen_cloth_115k.glb", 58081, 115200, 1, 58081, 115200, 1, 960, {0, 0, 0, 0, 0, 0, 0}},
    {"scallop_120k_colour_normals.glb", 60002, 120000, 1, 60002, 120000, 1, 0, {0, 0, 0, 0, 0, 0, 0}},
    {"spot_textured.glb", 3225, 5856, 13, 2930, 5856, 1, 0, {295, 0, 0, 0, 0, 0, 0}},
    {"duck.glb", 2399, 4212, 10, 2108, 4212, 1, 0, {291, 0, 0, 0, 0, 0, 0}},
    {"cesium_milk_truck.glb", 3564, 3624, 240, 1842, 3624, 14, 8, {1724, 0, 0, 0, 0, 0, 2}},
    {"dragon_stanford_48k_nonmanifold.ply",
     22998,
     47794,
     17,
     25042,
     46540,
     606,
     2766,
     {0, 16, 0, 1254, 72, 1677, 2060}},
    {"cube_40k_very_nonmanifold.obj", 9261, 96000, 1, 56122, 88000, 3, 26482, {0, 0, 0, 8000, 25200, 55580, 46861}},
    {"pig_17k_cracked.stl", 50544, 16848, 16848, 9085, 16848, 17, 1296, {41902, 0, 0, 0, 0, 0, 443}},
};

INSTANTIATE_TEST_SUITE_P(All, SharedMesh, ::testing::ValuesIn(kMeshes),
                         [](const ::testing::TestParamInfo<Expected>& param) {
                           const std::string file = param.param.file;
                           return file.substr(0, file.find('.'));
                         });

}  // namespace
}  // namespace fanstream
