#include "server/build/base_matching.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/common.hpp>
#include <set>

#include "tests/support/fan_test_meshes.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/ring_views.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

BaseMesh on_coarse_grid(const TriangleMesh& mesh, double scale) {
  BaseMesh base;
  for (const glm::dvec3& p : mesh.positions) base.places.emplace_back(glm::round(p * scale));
  base.triangles = mesh.triangles;
  return base;
}

// New numbers for vertices, faces in another order and turned; vertex v of the result was numbers[v].
BaseMesh renumbered(const BaseMesh& mesh, SeededRandom& random, std::vector<VertexId>& numbers) {
  numbers.resize(mesh.places.size());
  for (VertexId v = 0; v < numbers.size(); ++v) numbers[v] = v;
  random.shuffle(numbers);
  std::vector<VertexId> back(numbers.size());
  BaseMesh result;
  for (VertexId v = 0; v < numbers.size(); ++v) {
    back[numbers[v]] = v;
    result.places.push_back(mesh.places[numbers[v]]);
  }
  result.triangles = mesh.triangles;
  random.shuffle(result.triangles);
  for (Triangle& t : result.triangles) {
    for (VertexId& v : t) v = back[v];
    std::rotate(t.begin(), t.begin() + random.below(3), t.end());
  }
  return result;
}

// The matching turns the faces of `decoded` into those of `original`, and the places agree.
void expect_match(const BaseMesh& original, const BaseMesh& decoded) {
  const auto match = match_base(original, decoded);
  ASSERT_TRUE(match) << match.error().message;
  ASSERT_EQ(match->size(), original.places.size());
  EXPECT_EQ(std::set<VertexId>(match->begin(), match->end()).size(), original.places.size());
  const auto normal = [](std::vector<Triangle> faces) {
    for (Triangle& t : faces) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    std::sort(faces.begin(), faces.end());
    return faces;
  };
  std::vector<Triangle> faces = decoded.triangles;
  for (Triangle& t : faces) {
    for (VertexId& v : t) v = (*match)[v];
  }
  EXPECT_EQ(normal(faces), normal(original.triangles));
  for (VertexId v = 0; v < match->size(); ++v) ASSERT_EQ(decoded.places[v], original.places[(*match)[v]]);
}

TEST(BaseMatching, FindsRenumberedVertices) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    std::vector<VertexId> numbers;
    const BaseMesh original = on_coarse_grid(test::make_random_sphere(150, static_cast<std::uint32_t>(seed)), 1000.0);
    const BaseMesh decoded = renumbered(original, random, numbers);
    expect_match(original, decoded);
    const auto match = match_base(original, decoded);
    ASSERT_TRUE(match);
    EXPECT_EQ(*match, numbers);
  }
}

TEST(BaseMatching, FindsVerticesThatShareTheirPlaces) {
  TriangleMesh several = testing::make_torus(6, 6);
  testing::append(several, testing::make_torus(6, 6), {0, 0, 0});
  testing::append(several, testing::make_sphere(6, 6), {0, 0, 0});
  testing::append(several, testing::make_tetrahedron(), {0, 0, 0});
  testing::append(several, testing::make_tetrahedron(), {0, 0, 0});
  testing::append(several, testing::make_terrain(6, 6, 2), {0, 0, 0});
  for (const double scale : {100.0, 2.0, 0.4, 0.0}) {  // ever more vertices coincide, at last all
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      SCOPED_TRACE("scale " + std::to_string(scale) + ", seed " + std::to_string(seed));
      SeededRandom random(seed);
      std::vector<VertexId> numbers;
      const BaseMesh original = on_coarse_grid(several, scale);
      expect_match(original, renumbered(original, random, numbers));
    }
  }
}

TEST(BaseMatching, WhatDracoGivesBackMatches) {
  TriangleMesh mesh = testing::without_unused(test::punch_holes(test::make_random_sphere(200, 3), 2));
  testing::append(mesh, testing::make_grid(5, 5), {0, 0, 0});
  for (const double scale : {1000.0, 1.5}) {
    const BaseMesh original = on_coarse_grid(mesh, scale);
    const auto coded = encode_base(original);
    ASSERT_TRUE(coded) << coded.error().message;
    const auto decoded = decode_base(*coded, 10000);
    ASSERT_TRUE(decoded) << decoded.error().message;
    expect_match(original, *decoded);
  }
}

TEST(BaseMatching, OtherMeshesAreRefused) {
  const BaseMesh original = on_coarse_grid(testing::make_torus(6, 6), 100.0);
  BaseMesh moved = original;
  moved.places[17].x += 1;
  EXPECT_FALSE(match_base(original, moved));
  BaseMesh turned = original;
  for (Triangle& t : turned.triangles) std::swap(t[0], t[1]);
  EXPECT_FALSE(match_base(original, turned));
  BaseMesh less = original;
  less.triangles.pop_back();
  EXPECT_FALSE(match_base(original, less));
}

}  // namespace
}  // namespace fanstream
