#include "client/collision/mesh_contacts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <set>

#include "tests/support/mesh_generators.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using Corners = std::array<glm::dvec3, 3>;

double volume(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d) {
  return glm::dot(b - a, glm::cross(c - a, d - a));
}

// Whether the segment from p to q goes through the triangle; in general position.
bool goes_through(const glm::dvec3& p, const glm::dvec3& q, const Corners& t) {
  if ((volume(p, t[0], t[1], t[2]) > 0.0) == (volume(q, t[0], t[1], t[2]) > 0.0)) return false;
  const bool side = volume(p, q, t[0], t[1]) > 0.0;
  return side == (volume(p, q, t[1], t[2]) > 0.0) && side == (volume(p, q, t[2], t[0]) > 0.0);
}

bool intersect(const Corners& a, const Corners& b) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (goes_through(a[k], a[(k + 1) % 3], b) || goes_through(b[k], b[(k + 1) % 3], a)) return true;
  }
  return false;
}

Corners corners(const TriangleMesh& mesh, std::size_t triangle) {
  const Triangle& t = mesh.triangles[triangle];
  return {mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
}

TEST(MeshContacts, PairsAreThoseThatIntersect) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const TriangleMesh a = testing::make_random_soup(60, 80, seed);
    const TriangleMesh b = testing::make_random_soup(50, 70, seed + 100);
    const Result<MeshObstacle> obstacle = MeshObstacle::create(b);
    ASSERT_TRUE(obstacle);
    std::uint64_t expected = 0;
    for (std::size_t i = 0; i < a.triangles.size(); ++i) {
      for (std::size_t j = 0; j < b.triangles.size(); ++j) expected += intersect(corners(a, i), corners(b, j)) ? 1 : 0;
    }
    const MeshContacts found = find_contacts(patch_of(a), *obstacle);
    EXPECT_TRUE(found.all_found);
    EXPECT_EQ(found.touching_pairs, expected);
    EXPECT_EQ(found.original_pairs, expected);
    ASSERT_EQ(found.contacts.size(), expected);
    for (const MeshContact& c : found.contacts) {
      EXPECT_TRUE(intersect(c.corners, corners(b, c.obstacle_triangle)));
      EXPECT_GE(c.depth, 0.0);
      for (int axis = 0; axis < 3; ++axis) {  // both lie in the unit cube
        EXPECT_GE(c.position[axis], -1e-9);
        EXPECT_LE(c.position[axis], 1.0 + 1e-9);
      }
    }
    EXPECT_EQ(find_contacts(patch_of(a), *obstacle, 2).contacts.size(), std::min<std::uint64_t>(2, expected));
  }
}

TEST(MeshContacts, RegionReachesIntoEveryBoxThatATriangleTouches) {
  testing::SeededRandom random(4);
  const TriangleMesh mesh = testing::make_torus(20, 12);
  const auto region = region_of(MeshObstacle::create(mesh).value());
  int touched = 0;
  for (int i = 0; i < 500; ++i) {
    const glm::dvec3 low = 3.0 * glm::dvec3(random.unit(), random.unit(), random.unit()) - 1.5;
    const Bounds box{low, low + 0.3 * random.unit()};
    bool holds_vertex = false;
    for (const glm::dvec3& p : mesh.positions) {
      holds_vertex |= p.x >= box.low.x && p.x <= box.high.x && p.y >= box.low.y && p.y <= box.high.y &&
                      p.z >= box.low.z && p.z <= box.high.z;
    }
    EXPECT_TRUE(!holds_vertex || region(box));
    touched += region(box) ? 1 : 0;
  }
  EXPECT_GT(touched, 0);
  EXPECT_LT(touched, 400) << "it says something";
}

TEST(MeshObstacle, WithoutTrianglesOrWithBadOnesIsRefused) {
  EXPECT_FALSE(MeshObstacle::create({}));
  EXPECT_FALSE(MeshObstacle::create({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 3}}}));
  EXPECT_FALSE(MeshObstacle::create({{{0, 0, 0}, {NAN, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}}));
}

}  // namespace
}  // namespace fanstream
