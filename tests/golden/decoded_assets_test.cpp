// Assets in the repository decode to the meshes that they decoded to when they were made: on every machine, with every
// compiler and every Draco, whose order of faces and corners in FM0 decides where fans start (CODING.md). A change of
// the format comes with new assets (FuzzSeeds) and new hashes here.
#include <gtest/gtest.h>

#include <fstream>

#include "common/mesh/mesh_hash.h"
#include "tests/support/asset_helpers.h"

namespace fanstream {
namespace {

struct Golden {
  const char* name;
  const char* base;
  const char* full;
};

TEST(GoldenAssets, DecodeToTheSameMeshesEverywhere) {
  const Golden goldens[] = {
      {"sphere", "8b2feacce835692f7f503e153632cc45", "8044a6dae5aa70db909446a03f8e71fc"},
      {"torus", "1fe932998b64d6d21d235b5f8d429a28", "016dab1de1e67ab31b605b851d516090"},
      {"grid", "00b31c71ce805f078d5abed55d4630fb", "8a54551e7e9354082467ee3ba10aa402"},
      {"two", "d479321718ec7e9ec307cec1a9f16d23", "193f99039bb019f73754a6ad9dc59be2"},
      {"two_triangles", "f125f4fa264d046b4637e507c3e7f9f7", "f125f4fa264d046b4637e507c3e7f9f7"},
  };
  for (const Golden& golden : goldens) {
    SCOPED_TRACE(golden.name);
    std::ifstream file(std::string(FANSTREAM_SOURCE_DIR) + "/tests/fuzz/seeds/asset/" + golden.name + ".fan",
                       std::ios::binary);
    const std::vector<char> content{std::istreambuf_iterator<char>(file), {}};
    const std::span<const std::byte> bytes = std::as_bytes(std::span(content));
    const auto asset = testing::open_asset({bytes.begin(), bytes.end()});
    ASSERT_TRUE(asset) << asset.error().message;
    const auto mesh = testing::fully_refined(*asset);
    EXPECT_EQ(mesh_hash(mesh->triangle_mesh()), golden.full);
    mesh->coarsen_to(0);
    EXPECT_EQ(mesh_hash(mesh->triangle_mesh()), golden.base);
  }
}

}  // namespace
}  // namespace fanstream
