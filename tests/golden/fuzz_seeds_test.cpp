// The seeds of the fuzz targets of assets are whole assets of the format as it is: others are refused at their eighth
// byte, and fuzzing starts from nothing. FANSTREAM_UPDATE_GOLDEN=1 writes them anew; commit them when the format has
// changed.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "tests/fuzz/built_assets.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/exact_bytes.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/small_assets.h"

namespace fanstream {
namespace {

std::vector<std::pair<std::string, TriangleMesh>> seed_meshes() {
  TriangleMesh two = testing::make_sphere(8, 10);
  testing::append(two, testing::make_torus(10, 8), {6.0, 0.0, 0.0});
  return {{"sphere", testing::make_sphere(18, 24)},
          {"torus", testing::make_torus(24, 16)},
          {"grid", testing::make_grid(20, 20)},
          {"two", two},
          {"two_triangles", testing::make_grid(1, 1)}};
}

std::vector<char> contents(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(FuzzSeeds, AreAssetsOfTheFormatAsItIs) {
  for (const auto& [name, mesh] : seed_meshes()) {
    const std::string path = std::string(FANSTREAM_SOURCE_DIR) + "/tests/fuzz/seeds/asset/" + name + ".fan";
    SCOPED_TRACE(path);
    if (std::getenv("FANSTREAM_UPDATE_GOLDEN") != nullptr) {
      BuildOptions options = testing::small_build_options();
      options.position_bits = 8;
      const auto built = build_asset(mesh, options);
      ASSERT_TRUE(built) << built.error().message;
      std::ofstream(path, std::ios::binary) << testing::as_text(built->bytes);
    }
    const std::vector<char> seed = contents(path);
    const std::span<const std::byte> bytes = std::as_bytes(std::span(seed));
    const auto asset = testing::open_asset({bytes.begin(), bytes.end()});
    ASSERT_TRUE(asset) << asset.error().message;
    EXPECT_EQ(testing::fully_refined(*asset)->vertex_count(), mesh.positions.size());
  }
}

// An asset of the target's, then (cell, segment, size, bytes) of every third segment, one bit of each changed.
std::vector<char> segment_seed(std::uint8_t number, const testing::OpenAsset& asset) {
  std::vector<char> seed{static_cast<char>(number)};
  const auto segments = asset.segments();
  testing::SeededRandom random(number);
  for (std::size_t i = number; i < segments.size() && seed.size() < 400; i += 3) {
    const auto [cell, segment] = segments[i];
    testing::ExactBytes bytes(asset.segment(cell, segment));
    if (bytes.view().size() > 255 || cell > 255) continue;
    bytes.flip(random.below(8 * bytes.view().size()));
    for (const std::size_t n : {std::size_t{cell}, std::size_t{segment}, bytes.view().size()})
      seed.push_back(static_cast<char>(n));
    for (const std::byte b : bytes.view()) seed.push_back(static_cast<char>(b));
  }
  return seed;
}

// Else the target would take bytes of one segment for the place of another.
TEST(FuzzSeeds, OfSegmentsNameSegmentsThatThereAre) {
  const std::vector<std::vector<std::byte>> assets = testing::build_small_assets();
  for (std::uint8_t number = 0; number < 4; ++number) {
    const std::string path =
        std::string(FANSTREAM_SOURCE_DIR) + "/tests/fuzz/seeds/segment/replaced_" + std::to_string(number);
    SCOPED_TRACE(path);
    const auto asset = testing::open_asset(assets[number]);
    ASSERT_TRUE(asset) << asset.error().message;
    if (std::getenv("FANSTREAM_UPDATE_GOLDEN") != nullptr) {
      const std::vector<char> seed = segment_seed(number, *asset);
      std::ofstream(path, std::ios::binary).write(seed.data(), static_cast<std::streamsize>(seed.size()));
    }
    const std::vector<char> seed = contents(path);
    ASSERT_GT(seed.size(), 4U);
    EXPECT_EQ(seed[0], number);
    const auto number_at = [&](std::size_t at) { return static_cast<unsigned char>(seed[at]); };
    std::size_t at = 1;
    while (at < seed.size()) {
      ASSERT_LE(at + 3, seed.size());
      ASSERT_LT(number_at(at), asset->index->cells.size());
      ASSERT_LT(number_at(at + 1), asset->index->cells[number_at(at)].segment_count);
      ASSERT_EQ(number_at(at + 2) % 2, 0);
      at += 3U + number_at(at + 2);
    }
    EXPECT_EQ(at, seed.size());
  }
}

}  // namespace
}  // namespace fanstream
