// Every real mesh of ../shared/data imports and cleans to what its README states.
#include <gtest/gtest.h>

#include "common/mesh/manifold_check.h"
#include "server/import/mesh_cleaner.h"
#include "server/import/mesh_import.h"
#include "tests/support/drawn_triangles.h"
#include "tests/support/shared_data.h"

namespace fanstream {
namespace {

using namespace fanstream::testing;

struct Expected {
  const char* file;
  std::size_t vertices;   // in the file
  std::size_t triangles;  // in the file
};

class SharedMesh : public ::testing::TestWithParam<Expected> {};

TEST_P(SharedMesh, ImportsAndCleansToAnOrientedManifoldThatDrawsTheSame) {
  const Expected& expected = GetParam();
  const std::filesystem::path path = shared_mesh(expected.file);
  if (path.empty()) GTEST_SKIP() << expected.file << " is not in " << shared_data_folder();
  const Result<ImportedMesh> imported = import_mesh(path);
  ASSERT_TRUE(imported) << imported.error().message;
  EXPECT_TRUE(imported->warnings.empty()) << imported->warnings.front();
  EXPECT_EQ(imported->mesh.positions.size(), expected.vertices);
  EXPECT_EQ(imported->mesh.triangles.size(), expected.triangles);

  const CleanedMesh cleaned = clean_mesh(imported->mesh);
  std::string why;
  EXPECT_TRUE(is_oriented_manifold(cleaned.mesh, &why)) << why;
  EXPECT_TRUE(drawn_triangles(cleaned.mesh, false) == drawn_triangles(imported->mesh));
  std::string counts;
  for (const auto& [label, count] : named_counts(cleaned.report)) counts += label + ' ' + std::to_string(count) + ", ";
  RecordProperty("counts", counts);
  printf("%s: %zu vertices, %zu triangles, %zu components; %s\n", expected.file, cleaned.mesh.positions.size(),
         cleaned.mesh.triangles.size(), count_components(cleaned.mesh.positions.size(), cleaned.mesh.triangles),
         counts.c_str());
}

INSTANTIATE_TEST_SUITE_P(
    All, SharedMesh,
    ::testing::Values(
        Expected{"dragon_stanford_full.ply", 437645, 871414}, Expected{"armadillo_86k.ply", 43243, 86482},
        Expected{"stanford_bunny_zipper.ply", 35947, 69451}, Expected{"skull_100k_genus2.ply", 49999, 100002},
        Expected{"boot_40k_genus12.ply", 19931, 39906}, Expected{"mountain_terrain_51k_open.ply", 25600, 50562},
        Expected{"fandisk_13k.obj", 6475, 12946}, Expected{"cow_2904v.off", 2904, 5804},
        Expected{"sheen_cloth_115k.glb", 58081, 115200}, Expected{"scallop_120k_colour_normals.glb", 60002, 120000},
        Expected{"spot_textured.glb", 3225, 5856}, Expected{"duck.glb", 2399, 4212},
        Expected{"cesium_milk_truck.glb", 3564, 3624}, Expected{"dragon_stanford_48k_nonmanifold.ply", 22998, 47794},
        Expected{"cube_40k_very_nonmanifold.obj", 9261, 96000}, Expected{"pig_17k_cracked.stl", 50544, 16848}),
    [](const ::testing::TestParamInfo<Expected>& param) {
      const std::string file = param.param.file;
      return file.substr(0, file.find('.'));
    });

}  // namespace
}  // namespace fanstream
