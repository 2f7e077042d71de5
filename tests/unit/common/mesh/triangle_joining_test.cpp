#include "common/mesh/triangle_joining.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/support/mesh_generators.h"
#include "tests/support/polygon_sources.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

std::vector<VertexId> corners(const JoinedFaces& faces, std::uint32_t f) {
  return {faces.face(f).begin(), faces.face(f).end()};
}

JoinedFaces join(const TriangleMesh& mesh, const std::vector<std::uint32_t>& source_faces) {
  std::vector<std::uint8_t> inner = inner_edges(mesh.triangles, source_faces);
  return join_triangles(mesh.triangles, inner);
}

TEST(TriangleJoining, MakesTheQuadsOfAGrid) {
  const TriangleMesh grid = testing::make_grid(5, 3);
  const JoinedFaces faces = join(grid, testing::paired_source_faces(grid));
  ASSERT_EQ(faces.face_count(), 15U);
  for (std::uint32_t f = 0; f < faces.face_count(); ++f) {
    ASSERT_EQ(faces.face(f).size(), 4U);
    EXPECT_EQ(faces.face(f)[0], *std::min_element(faces.face(f).begin(), faces.face(f).end()));
  }
  EXPECT_EQ(faces.face_of_triangle[7], 3U);
}

TEST(TriangleJoining, WithoutSourceFacesAllStayTriangles) {
  const TriangleMesh sphere = testing::make_sphere(5, 7);
  EXPECT_EQ(join(sphere, {}).face_count(), sphere.triangles.size());
}

TEST(TriangleJoining, AnEdgeThatOnlyOneSideCallsADiagonalIsNone) {
  const std::vector<Triangle> two{{0, 1, 2}, {2, 1, 3}};
  std::vector<std::uint8_t> inner{0b010, 0};
  EXPECT_EQ(join_triangles(two, inner).face_count(), 2U);
  EXPECT_EQ(inner, (std::vector<std::uint8_t>{0, 0}));
  inner = {0b010, 0b001};
  const JoinedFaces joined = join_triangles(two, inner);
  ASSERT_EQ(joined.face_count(), 1U);
  EXPECT_EQ(corners(joined, 0), (std::vector<VertexId>{0, 1, 3, 2}));
}

TEST(TriangleJoining, WhatIsNoDiscStaysApart) {
  // A closed fan, whose centre would lie inside; and a whole sphere.
  const std::vector<Triangle> fan{{0, 1, 2}, {0, 2, 3}, {0, 3, 1}};
  std::vector<std::uint8_t> inner(3, 0b101);
  EXPECT_EQ(join_triangles(fan, inner).face_count(), 3U);
  EXPECT_EQ(inner, std::vector<std::uint8_t>(3, 0));
  const TriangleMesh sphere = testing::make_sphere(6, 8);
  EXPECT_EQ(join(sphere, std::vector<std::uint32_t>(sphere.triangles.size(), 0)).face_count(), sphere.triangles.size());
}

TEST(TriangleJoining, APolygonThatMeetsItselfInACornerStaysApart) {
  // Five triangles around vertex 0, but not all the way: the first and the last one share vertex 5 as well.
  const std::vector<Triangle> strip{{0, 5, 1}, {0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {3, 5, 4}};
  const std::vector<std::uint32_t> one(strip.size(), 0);
  std::vector<std::uint8_t> inner = inner_edges(strip, one);
  EXPECT_EQ(join_triangles(strip, inner).face_count(), strip.size());
}

TEST(TriangleJoining, PolygonsOfTooManyCornersStayApart) {
  for (const std::uint32_t count : {kMostPolygonCorners, kMostPolygonCorners + 1}) {
    std::vector<Triangle> fan;
    for (VertexId v = 1; v + 1 < count; ++v) fan.push_back({0, v, v + 1});
    std::vector<std::uint8_t> inner = inner_edges(fan, std::vector<std::uint32_t>(fan.size(), 7));
    EXPECT_EQ(join_triangles(fan, inner).face_count(), count == kMostPolygonCorners ? 1U : fan.size());
  }
}

// Whatever the bits: every face is a simple polygon, and the faces' outlines are the edges that are not joined across.
TEST(TriangleJoining, AnyBitsGiveSimplePolygonsThatCoverTheMesh) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    SeededRandom random(seed);
    const TriangleMesh mesh = testing::shuffled(testing::make_torus(6, 5), seed);
    std::vector<std::uint8_t> inner(mesh.triangles.size());
    const std::uint32_t rarity = 1 + random.below(4);
    for (std::uint8_t& bits : inner) bits = random.one_in(rarity) ? static_cast<std::uint8_t>(random.below(8)) : 0;
    const JoinedFaces faces = join_triangles(mesh.triangles, inner);
    std::size_t triangles = 0;
    std::set<std::pair<VertexId, VertexId>> outline;
    for (std::uint32_t f = 0; f < faces.face_count(); ++f) {
      const auto face = faces.face(f);
      ASSERT_EQ(std::set<VertexId>(face.begin(), face.end()).size(), face.size());
      triangles += face.size() - 2;
      for (std::size_t i = 0; i < face.size(); ++i) {
        EXPECT_TRUE(outline.insert({face[i], face[(i + 1) % face.size()]}).second);
      }
    }
    EXPECT_EQ(triangles, mesh.triangles.size());
    std::size_t joined = 0;
    for (std::size_t t = 0; t < inner.size(); ++t) {
      for (int k = 0; k < 3; ++k) {
        const std::pair edge(mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]);
        const bool is_inner = (inner[t] >> k & 1) != 0;
        EXPECT_EQ(outline.count(edge), is_inner ? 0U : 1U);
        joined += is_inner ? 1 : 0;
      }
    }
    EXPECT_EQ(outline.size() + joined, 3 * inner.size());
  }
}

}  // namespace
}  // namespace fanstream
