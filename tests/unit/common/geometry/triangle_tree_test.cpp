#include "common/geometry/triangle_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <random>

#include "common/geometry/closest_point.h"
#include "tests/unit/common/geometry/geometry_shapes.h"

namespace fanstream {
namespace {

double brute_force(const TriangleMesh& mesh, const glm::dvec3& query) {
  double best = std::numeric_limits<double>::infinity();
  for (const Triangle& t : mesh.triangles) {
    const glm::dvec3 point =
        closest_point_on_triangle(query, mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]);
    best = std::min(best, glm::dot(query - point, query - point));
  }
  return best;
}

void expect_agreement(const TriangleMesh& mesh, std::uint64_t seed, double reach, const glm::dvec3& centre = {}) {
  SCOPED_TRACE(seed);
  const Result<TriangleTree> tree = TriangleTree::build(mesh);
  ASSERT_TRUE(tree) << tree.error().message;
  const double size = bounds_of(mesh.positions).diagonal();
  std::mt19937_64 random(seed);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1.0p-52 - 1.0; };
  std::uint32_t hint = 0;
  for (int i = 0; i < 400; ++i) {
    const glm::dvec3 query = centre + reach * glm::dvec3(uniform(), uniform(), uniform());
    const SurfacePoint found = tree->closest(query, hint);
    hint = found.slot;
    const double expected = std::sqrt(brute_force(mesh, query));
    const double rounding = 1e-14 * std::max(expected, size) + 1e-15 * glm::length(query);
    EXPECT_NEAR(std::sqrt(found.squared_distance), expected, rounding);
    EXPECT_NEAR(std::sqrt(tree->closest(query).squared_distance), expected, rounding) << "without the hint";
    EXPECT_EQ(found.squared_distance, glm::dot(query - found.position, query - found.position));
    const Triangle& t = mesh.triangles[tree->triangle(found.slot)];
    EXPECT_EQ(closest_point_on_triangle(query, mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]),
              found.position);
  }
}

TEST(TriangleTree, FindsWhatALoopOverAllTrianglesFinds) {
  for (const unsigned count : {1U, 2U, 4U, 5U, 16U, 17U, 300U, 3000U}) {
    SCOPED_TRACE(count);
    expect_agreement(geometry_shapes::random_triangles(count, count), 10 + count, 2.0);
  }
  expect_agreement(geometry_shapes::octasphere(4, 1.0), 1, 1.5);
  expect_agreement(geometry_shapes::octasphere(4, 1.0), 2, 1000.0);
}

TEST(TriangleTree, BoxesInFloatsLoseNothingFarFromTheOriginOrAtExtremeScales) {
  TriangleMesh mesh = geometry_shapes::octasphere(4, 1.0);
  for (glm::dvec3& p : mesh.positions) p += glm::dvec3(1e7, -3e6, 4e7);
  expect_agreement(mesh, 3, 1.5, {1e7, -3e6, 4e7});
  expect_agreement(geometry_shapes::octasphere(3, 1e-40), 4, 1.5e-40);
  expect_agreement(geometry_shapes::octasphere(3, 1e60), 5, 1.5e60);
  expect_agreement(geometry_shapes::octasphere(3, 1e-30), 6, 1.0);
}

TEST(TriangleTree, QueriesOnTheSurfaceFindIt) {
  const TriangleMesh mesh = geometry_shapes::octasphere(5, 3.0);
  const Result<TriangleTree> tree = TriangleTree::build(mesh);
  ASSERT_TRUE(tree);
  for (const Triangle& t : mesh.triangles) {
    EXPECT_EQ(tree->closest(mesh.positions[t[0]]).squared_distance, 0.0);
    const glm::dvec3 middle = (mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3.0;
    EXPECT_LT(tree->closest(middle).squared_distance, 1e-28);
  }
}

TEST(TriangleTree, HoldsEveryTriangleOnceEvenIfAllOfThemCoincide) {
  for (const bool coincident : {false, true}) {
    TriangleMesh mesh = geometry_shapes::octasphere(4, 1.0);
    if (coincident) std::fill(mesh.triangles.begin(), mesh.triangles.end(), Triangle{0, 2, 4});
    const Result<TriangleTree> tree = TriangleTree::build(mesh);
    ASSERT_TRUE(tree);
    std::vector<bool> seen(mesh.triangles.size(), false);
    for (const std::uint32_t i : tree->triangles_in_order()) seen[i] = true;
    EXPECT_EQ(tree->triangle_count(), mesh.triangles.size());
    EXPECT_EQ(tree->triangles_in_order().size(), mesh.triangles.size());
    EXPECT_EQ(std::count(seen.begin(), seen.end(), true), static_cast<std::ptrdiff_t>(mesh.triangles.size()));
    expect_agreement(mesh, 7, 2.0);
  }
}

// Its own arithmetic for two triangles at a time must be as good on needles as that for one.
TEST(TriangleTree, NeedlesAreFoundAsAccuratelyAsAlone) {
  std::mt19937_64 random(12);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1.0p-52 - 1.0; };
  for (const double height : {1e-3, 1e-8, 1e-12, 1e-14, 1e-15, 3e-16, 1e-16, 0.0}) {
    SCOPED_TRACE(height);
    for (int turn = 0; turn < 300; ++turn) {
      SCOPED_TRACE(turn);
      const glm::dvec3 along = glm::normalize(glm::dvec3(uniform(), uniform(), uniform()));
      const glm::dvec3 across = glm::normalize(glm::cross(along, glm::dvec3(uniform(), uniform(), uniform())));
      const glm::dvec3 a(uniform(), uniform(), uniform());
      const glm::dvec3 above = a + 0.3 * along + 0.5 * glm::cross(along, across);
      const glm::dvec3 in_line = a + 1.5 * along;
      for (const glm::dvec3& query : {above, in_line}) {
        // A second triangle, hardly farther, is the answer of whoever judges the needle to be farther than it is.
        const glm::dvec3 beside = query + along * (0.5 + 1e-9);
        TriangleMesh mesh;
        mesh.positions = {a, a + along, a + 0.4 * along + height * across, beside, beside + along, beside + across};
        for (const Triangle& needle : {Triangle{0, 1, 2}, Triangle{1, 2, 0}, Triangle{2, 0, 1}}) {
          mesh.triangles = {needle, {3, 4, 5}};
          const Result<TriangleTree> tree = TriangleTree::build(mesh);
          ASSERT_TRUE(tree);
          EXPECT_NEAR(std::sqrt(tree->closest(query).squared_distance), 0.5, 1e-10);
        }
      }
    }
  }
}

// Sizes that shrink geometrically make the heuristic cut off a few triangles at a time.
TEST(TriangleTree, TrianglesWhoseSizesSpanManyMagnitudesAreFound) {
  TriangleMesh mesh;
  for (int i = 0; i < 4000; ++i) {
    const double size = std::pow(0.985, i);
    const auto first = static_cast<VertexId>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {{size, 0, 0}, {size * 1.001, 0, size}, {size, size, 0}});
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  expect_agreement(mesh, 8, 1e-3);
  expect_agreement(mesh, 9, 1.0);
}

TEST(TriangleTree, RefusesWhatIsNoSurfaceAndSaysWhere) {
  const auto message_of = [](const TriangleMesh& mesh) {
    const Result<TriangleTree> tree = TriangleTree::build(mesh);
    EXPECT_FALSE(tree);
    return tree ? std::string() : tree.error().message;
  };
  EXPECT_NE(message_of({}).find("no triangles"), std::string::npos);
  TriangleMesh mesh = geometry_shapes::flat_square(2, 0.0);
  mesh.triangles[3][1] = 9;
  EXPECT_NE(message_of(mesh).find("triangle 3 names vertex 9 of 9"), std::string::npos);
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), -1e71}) {
    mesh = geometry_shapes::flat_square(2, 0.0);
    mesh.positions[4].z = bad;
    EXPECT_NE(message_of(mesh).find("vertex 4"), std::string::npos);
  }
}

}  // namespace
}  // namespace fanstream
