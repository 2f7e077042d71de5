#include "common/coding/base_coder.h"

#include <gtest/gtest.h>

#include "common/grid/position_grid.h"
#include "common/mesh/manifold_check.h"
#include "tests/support/exact_bytes.h"
#include "tests/support/fan_test_meshes.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/ring_views.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::ExactBytes;
using testing::face_keys;
using testing::SeededRandom;

BaseMesh base_of(const TriangleMesh& mesh, int bits) {
  const PositionGrid grid = PositionGrid::fit(mesh.positions, bits);
  BaseMesh base;
  for (const glm::dvec3& p : mesh.positions) base.places.push_back(grid.encode(p));
  base.triangles = mesh.triangles;
  return base;
}

TriangleMesh as_mesh(const BaseMesh& base) {
  TriangleMesh mesh;
  for (const GridPoint& p : base.places) mesh.positions.emplace_back(p);
  mesh.triangles = base.triangles;
  return mesh;
}

std::vector<std::pair<std::string, TriangleMesh>> shapes() {
  std::vector<std::pair<std::string, TriangleMesh>> all;
  all.emplace_back("triangle", TriangleMesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
  all.emplace_back("square", testing::make_grid(1, 1));
  all.emplace_back("tetrahedron", testing::make_tetrahedron());
  all.emplace_back("torus", testing::make_torus(8, 9));
  all.emplace_back("terrain", testing::make_terrain(9, 8, 1));
  all.emplace_back("cylinder", testing::make_open_cylinder(9, 3));
  all.emplace_back("wild sphere with holes",
                   testing::without_unused(test::punch_holes(test::make_random_sphere(200, 4), 3)));
  TriangleMesh several = testing::make_torus(5, 5);
  testing::append(several, testing::make_torus(5, 5), {0, 0, 0});  // at the very same places
  testing::append(several, testing::make_grid(2, 2), {5, 0, 0});
  testing::append(several, testing::make_tetrahedron(), {9, 0, 0});
  all.emplace_back("components", several);
  return all;
}

TEST(BaseCoder, KeepsTheMesh) {
  for (const auto& [name, mesh] : shapes()) {
    for (const int bits : {6, 12, 20}) {
      SCOPED_TRACE(name + ", " + std::to_string(bits) + " bits");
      const BaseMesh base = base_of(mesh, bits);
      const auto coded = encode_base(base);
      ASSERT_TRUE(coded) << coded.error().message;
      const auto decoded = decode_base(*coded, static_cast<std::uint32_t>(base.places.size()));
      ASSERT_TRUE(decoded) << decoded.error().message;
      EXPECT_EQ(decoded->places.size(), base.places.size());
      EXPECT_EQ(face_keys(as_mesh(*decoded)), face_keys(as_mesh(base)));
      EXPECT_TRUE(is_oriented_manifold(as_mesh(*decoded)));
    }
  }
}

TEST(BaseCoder, CoincidentVerticesSurvive) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    BaseMesh base = base_of(test::make_random_sphere(60, static_cast<std::uint32_t>(seed)), 12);
    for (GridPoint& p : base.places) p = {random.between(0, 2), random.between(0, 2), 0};
    const auto coded = encode_base(base);
    ASSERT_TRUE(coded) << coded.error().message;
    const auto decoded = decode_base(*coded, 60);
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_EQ(decoded->places.size(), base.places.size());
    EXPECT_EQ(face_keys(as_mesh(*decoded)), face_keys(as_mesh(base)));
    EXPECT_TRUE(is_oriented_manifold(as_mesh(*decoded)));
  }
}

TEST(BaseCoder, RefusesMoreVerticesThanTheModelHas) {
  const auto coded = encode_base(base_of(testing::make_torus(8, 9), 12));
  ASSERT_TRUE(coded);
  EXPECT_TRUE(decode_base(*coded, 72));
  const auto refused = decode_base(*coded, 71);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::limit);
}

// Either an error, or a mesh that splits can be applied to.
void expect_safe(std::span<const std::byte> bytes) {
  const auto decoded = decode_base(bytes, 4000);
  if (!decoded) {
    EXPECT_FALSE(decoded.error().message.empty());
    return;
  }
  EXPECT_LE(decoded->places.size(), 4000U);
  EXPECT_TRUE(is_oriented_manifold(as_mesh(*decoded)));
}

TEST(BaseCoder, EveryTruncationIsSafe) {
  const auto coded = encode_base(base_of(testing::make_terrain(9, 8, 1), 12));
  ASSERT_TRUE(coded);
  for (std::size_t size = 0; size < coded->size(); ++size) {
    SCOPED_TRACE(size);
    const ExactBytes shorter{std::span(*coded).first(size)};
    expect_safe(shorter.view());
  }
}

TEST(BaseCoder, EveryFlippedBitIsSafe) {
  const auto coded = encode_base(base_of(testing::make_torus(5, 6), 10));
  ASSERT_TRUE(coded);
  ExactBytes bytes(*coded);
  for (std::size_t bit = 0; bit < bytes.view().size() * 8; ++bit) {
    SCOPED_TRACE("bit " + std::to_string(bit));
    bytes.flip(bit);
    expect_safe(bytes.view());
    bytes.flip(bit);
  }
}

TEST(BaseCoder, RandomBytesAreSafe) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    std::vector<std::byte> noise(random.below(400));
    for (std::byte& b : noise) b = static_cast<std::byte>(random.below(256));
    // Half of them start like Draco data, or they would never come far.
    const char* start = "DRACO\2\2\1\1";
    for (std::size_t i = 0; i < 9 && i < noise.size() && random.one_in(2); ++i)
      noise[i] = static_cast<std::byte>(start[i]);
    expect_safe(ExactBytes(noise).view());
  }
}

}  // namespace
}  // namespace fanstream
