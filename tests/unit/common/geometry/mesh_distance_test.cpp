#include "common/geometry/mesh_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "tests/unit/common/geometry/geometry_shapes.h"

namespace fanstream {
namespace {

using geometry_shapes::flat_square;
using geometry_shapes::octasphere;

MeshDistance measured(const TriangleMesh& a, const TriangleMesh& b, const DistanceOptions& options = {}) {
  const Result<MeshDistance> distance = mesh_distance(a, b, options);
  EXPECT_TRUE(distance) << distance.error().message;
  return distance.value_or(MeshDistance{});
}

TEST(MeshDistance, OfAMeshToItselfIsZero) {
  const TriangleMesh mesh = octasphere(4, 2.0);
  const MeshDistance distance = measured(mesh, mesh);
  EXPECT_LT(distance.max(), 1e-15);
  EXPECT_EQ(distance.forward.samples, DistanceOptions{}.face_samples + mesh.positions.size());
}

TEST(MeshDistance, OfParallelPlanesIsTheirOffsetEverywhere) {
  const MeshDistance distance = measured(flat_square(3, 0.0), flat_square(7, 0.25));
  for (const DirectedDistance& way : {distance.forward, distance.backward}) {
    EXPECT_NEAR(way.rms, 0.25, 1e-12);
    EXPECT_NEAR(way.mean, 0.25, 1e-12);
    EXPECT_NEAR(way.max, 0.25, 1e-15);
  }
  EXPECT_NEAR(distance.diagonal, std::sqrt(2.0), 1e-15);
  EXPECT_NEAR(distance.relative_rms(), 0.25 / std::sqrt(2.0), 1e-12);
}

// A part of a surface is at distance zero from the whole, while the whole is far from the part: a unit square in a
// square of side 2 that shares a corner. Outside x > 1 or y > 1 the distance is that to the small square.
TEST(MeshDistance, OfAPartToTheWholeDiffersByDirection) {
  const MeshDistance distance = measured(flat_square(5, 0.0, 2.0), flat_square(4, 0.0, 1.0));
  EXPECT_NEAR(distance.backward.max, 0.0, 1e-15);
  EXPECT_NEAR(distance.forward.max, std::sqrt(2.0), 1e-12);
  EXPECT_EQ(distance.forward.max_position, glm::dvec3(2, 2, 0));
  // The integral of d^2 over two strips of 1 x 1 is 1/3 each, over the corner square 2/3; the area is 4.
  EXPECT_NEAR(distance.forward.rms, std::sqrt((1.0 / 3 + 1.0 / 3 + 2.0 / 3) / 4), 1e-3);
  // The integral of d: 1/2 for each strip, (sqrt 2 + asinh 1) / 3 for the corner square.
  EXPECT_NEAR(distance.forward.mean, (1.0 + (std::sqrt(2.0) + std::asinh(1.0)) / 3) / 4, 1e-3);
  EXPECT_EQ(distance.rms(), distance.forward.rms);
  EXPECT_EQ(distance.max(), distance.forward.max);
}

TEST(MeshDistance, OfConcentricSpheresIsTheDifferenceOfTheirRadii) {
  const MeshDistance distance = measured(octasphere(6, 1.0), octasphere(6, 1.1), {20'000, 1});
  EXPECT_NEAR(distance.forward.rms, 0.1, 1e-3);
  EXPECT_NEAR(distance.backward.rms, 0.1, 1e-3);
  EXPECT_NEAR(distance.max(), 0.1, 1e-3);
  EXPECT_GE(distance.max(), distance.rms());
  EXPECT_GE(distance.rms(), distance.mean());
}

// Chords of a sphere: the octahedron's corners lie on the sphere, its face centres are deepest inside.
TEST(MeshDistance, MaximumFindsTheDeepestPointOfACoarseSphere) {
  const MeshDistance distance = measured(octasphere(6, 1.0), octasphere(0, 1.0), {10'000, 1});
  EXPECT_NEAR(distance.forward.max, 1.0 - 1.0 / std::sqrt(3.0), 1e-3);
  EXPECT_NEAR(std::abs(distance.forward.max_position.x), 1.0 / std::sqrt(3.0), 2e-2);
}

TEST(MeshDistance, SwappingTheMeshesSwapsTheDirections) {
  const TriangleMesh a = octasphere(3, 1.0);
  const TriangleMesh b = octasphere(4, 1.2);
  const MeshDistance one = measured(a, b, {20'000, 1});
  const MeshDistance other = measured(b, a, {20'000, 1});
  EXPECT_EQ(one.forward.rms, other.backward.rms);
  EXPECT_EQ(one.backward.max, other.forward.max);
  EXPECT_EQ(one.rms(), other.rms());
  EXPECT_EQ(one.max(), other.max());
}

TEST(MeshDistance, SeedAloneDecidesTheSamples) {
  const TriangleMesh a = geometry_shapes::random_triangles(200, 1);
  const TriangleMesh b = geometry_shapes::random_triangles(200, 2);
  const DirectedDistance first = measured(a, b, {20'000, 7}).forward;
  const DirectedDistance again = measured(a, b, {20'000, 7}).forward;
  const DirectedDistance other = measured(a, b, {20'000, 8}).forward;
  EXPECT_EQ(first.rms, again.rms);
  EXPECT_EQ(first.max, again.max);
  EXPECT_NE(first.rms, other.rms);
  EXPECT_NEAR(first.rms, other.rms, 0.02 * first.rms);
}

// Splitting the faces of one half very finely must not make that half weigh more.
TEST(MeshDistance, SamplesAreProportionalToAreaAndNotToTriangles) {
  TriangleMesh uneven = flat_square(40, 0.0);
  const TriangleMesh coarse_half = flat_square(1, 0.5);
  for (const Triangle& t : coarse_half.triangles) {
    const auto offset = static_cast<VertexId>(uneven.positions.size());
    uneven.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  }
  uneven.positions.insert(uneven.positions.end(), coarse_half.positions.begin(), coarse_half.positions.end());
  EXPECT_NEAR(measured(uneven, flat_square(1, 0.0)).forward.mean, 0.25, 1e-4);
}

TEST(MeshDistance, AReferenceTreeGivesTheSameFigures) {
  const TriangleMesh a = octasphere(4, 1.0);
  const TriangleMesh b = octasphere(2, 1.0);
  const Result<TriangleTree> tree_of_a = TriangleTree::build(a);
  const Result<TriangleTree> tree_of_b = TriangleTree::build(b);
  ASSERT_TRUE(tree_of_a && tree_of_b);
  const Result<MeshDistance> reused = mesh_distance(a, *tree_of_a, b);
  const Result<DirectedDistance> forward = directed_distance(a, *tree_of_b);
  ASSERT_TRUE(reused && forward);
  EXPECT_EQ(reused->rms(), measured(a, b).rms());
  EXPECT_EQ(forward->rms, reused->forward.rms);
}

TEST(MeshDistance, SurfacesWithoutAreaAreJudgedByTheirVertices) {
  TriangleMesh needle;
  needle.positions = {{0, 0, 1}, {1, 0, 1}, {0.5, 0, 1}, {77, 77, 77}};
  needle.triangles = {{0, 1, 2}};
  const MeshDistance distance = measured(needle, flat_square(2, 0.0));
  EXPECT_DOUBLE_EQ(distance.forward.rms, 1.0);
  EXPECT_EQ(distance.forward.samples, 3U) << "the unused vertex is not part of the surface";
  EXPECT_DOUBLE_EQ(distance.diagonal, 1.0);

  TriangleMesh point;
  point.positions = {{0, 0, 0}};
  point.triangles = {{0, 0, 0}};
  EXPECT_EQ(measured(point, flat_square(2, 1.0)).relative_rms(), 0.0);
  EXPECT_EQ(measured(point, flat_square(2, 1.0)).forward.rms, 1.0);
}

TEST(MeshDistance, ErrorsSayWhichMeshIsEmptyOrBroken) {
  const TriangleMesh good = flat_square(2, 0.0);
  const Result<MeshDistance> first = mesh_distance({}, good);
  ASSERT_FALSE(first);
  EXPECT_EQ(first.error().kind, ErrorKind::bad_input);
  EXPECT_EQ(first.error().message.rfind("first mesh: ", 0), 0U) << first.error().message;
  const Result<MeshDistance> second = mesh_distance(good, {});
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().message.rfind("second mesh: ", 0), 0U) << second.error().message;
  const Result<TriangleTree> tree = TriangleTree::build(good);
  ASSERT_TRUE(tree);
  EXPECT_FALSE(directed_distance({}, *tree));
}

}  // namespace
}  // namespace fanstream
