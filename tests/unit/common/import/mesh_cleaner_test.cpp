#include "common/import/mesh_cleaner.h"

#include <gtest/gtest.h>

#include <array>

#include "common/mesh/manifold_check.h"
#include "tests/support/drawn_triangles.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

using namespace fanstream::testing;

// Cleans, checks every promise that holds for any input, and returns the result.
CleanedMesh clean_and_check(const TriangleMesh& input) {
  CleanedMesh cleaned = clean_mesh(input);
  const RepairReport& report = cleaned.report;
  std::string why;
  EXPECT_TRUE(is_oriented_manifold(cleaned.mesh, &why)) << why;
  EXPECT_EQ(drawn_triangles(cleaned.mesh, false), drawn_triangles(input));
  EXPECT_EQ(input.positions.size() + report.split_vertices,
            cleaned.mesh.positions.size() + report.welded_vertices + report.unreferenced_vertices);
  EXPECT_EQ(input.triangles.size(),
            cleaned.mesh.triangles.size() + report.degenerate_triangles + report.duplicate_triangles);
  const CleanedMesh again = clean_mesh(input);
  EXPECT_EQ(again.mesh.positions, cleaned.mesh.positions);
  EXPECT_EQ(again.mesh.triangles, cleaned.mesh.triangles);
  return cleaned;
}

std::size_t components(const TriangleMesh& mesh) { return count_components(mesh.positions.size(), mesh.triangles); }

TEST(MeshCleaner, LeavesAManifoldAsItIs) {
  for (const TriangleMesh& mesh : {make_tetrahedron(), make_sphere(9, 14), make_torus(7, 5), make_terrain(12, 7, 1),
                                   make_open_cylinder(3, 1), make_grid(1, 1), TriangleMesh{}}) {
    const CleanedMesh cleaned = clean_and_check(mesh);
    EXPECT_EQ(cleaned.report, RepairReport{});
    EXPECT_EQ(cleaned.mesh.positions, mesh.positions);
    EXPECT_EQ(cleaned.mesh.triangles, mesh.triangles);
  }
}

TEST(MeshCleaner, WeldsATriangleSoupBackIntoItsSurface) {
  const TriangleMesh sphere = make_sphere(9, 14);
  const CleanedMesh cleaned = clean_and_check(explode(sphere));
  EXPECT_EQ(cleaned.mesh.positions.size(), sphere.positions.size());
  EXPECT_EQ(cleaned.report.welded_vertices, 3 * sphere.triangles.size() - sphere.positions.size());
  EXPECT_EQ(components(cleaned.mesh), 1U);
  EXPECT_EQ(cleaned.report.split_vertices, 0U);
}

TEST(MeshCleaner, WeldsMinusZeroWithZeroAndNothingElse) {
  const TriangleMesh mesh{{{0.0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-0.0, 0, -0.0}, {0, -1, 0}, {1e-300, 0, 0}},
                          {{0, 1, 2}, {3, 4, 1}, {5, 2, 4}}};
  EXPECT_EQ(clean_and_check(mesh).report.welded_vertices, 1U);
}

TEST(MeshCleaner, DropsDegenerateAndDuplicateTrianglesAndUnreferencedVertices) {
  TriangleMesh mesh = make_tetrahedron();
  mesh.positions.push_back(mesh.positions[0]);  // 4: a copy of 0
  mesh.positions.emplace_back(7, 7, 7);         // 5: used by nothing
  mesh.positions.emplace_back(8, 8, 8);         // 6: used by a degenerate triangle only
  mesh.triangles.push_back({0, 1, 4});          // degenerate once welded
  mesh.triangles.push_back({6, 6, 1});          // degenerate
  mesh.triangles.push_back({2, 1, 4});          // triangle 0 again, rotated, through the copy
  mesh.triangles.push_back({1, 0, 3});          // triangle 1 again, reversed
  const CleanedMesh cleaned = clean_and_check(mesh);
  EXPECT_EQ(cleaned.report.welded_vertices, 1U);
  EXPECT_EQ(cleaned.report.unreferenced_vertices, 2U);
  EXPECT_EQ(cleaned.report.degenerate_triangles, 2U);
  EXPECT_EQ(cleaned.report.duplicate_triangles, 2U);
  EXPECT_EQ(cleaned.report.flipped_triangles, 0U);
  EXPECT_EQ(cleaned.mesh.triangles, make_tetrahedron().triangles);
}

TEST(MeshCleaner, KeepsTrianglesWithoutAreaThatHaveThreePositions) {
  // The middle triangle is a sliver on a line: without it the two outer ones would not meet.
  const TriangleMesh mesh{{{0, 0, 0}, {2, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, -1, 0}},
                          {{0, 2, 3}, {2, 1, 3}, {0, 1, 2}, {1, 0, 4}}};
  const CleanedMesh cleaned = clean_and_check(mesh);
  EXPECT_EQ(cleaned.report, RepairReport{});
  EXPECT_EQ(components(cleaned.mesh), 1U);
}

TEST(MeshCleaner, MakesWindingsFollowTheMajorityOfEachComponent) {
  TriangleMesh mesh = make_sphere(9, 14);
  append(mesh, make_torus(7, 5), {4, 0, 0});
  TriangleMesh input = mesh;
  for (std::size_t i = 0; i < input.triangles.size(); i += 3) std::swap(input.triangles[i][0], input.triangles[i][1]);
  const CleanedMesh cleaned = clean_and_check(input);
  EXPECT_EQ(cleaned.report.flipped_triangles, (mesh.triangles.size() + 2) / 3);
  EXPECT_EQ(cleaned.report.split_edges, 0U);
  const auto rotated_to_smallest = [](std::vector<Triangle> triangles) {
    for (Triangle& t : triangles) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return triangles;
  };
  EXPECT_EQ(rotated_to_smallest(cleaned.mesh.triangles), rotated_to_smallest(mesh.triangles));
}

TEST(MeshCleaner, CutsAMoebiusStripAlongOneSeam) {
  for (const unsigned segments : {3U, 8U, 31U}) {
    const CleanedMesh cleaned = clean_and_check(make_moebius(segments));
    EXPECT_EQ(cleaned.report.split_edges, 1U);
    EXPECT_EQ(cleaned.report.split_vertices, 2U);
    EXPECT_EQ(components(cleaned.mesh), 1U);
  }
}

TEST(MeshCleaner, SplitsFansThatMeetInOneVertex) {
  const CleanedMesh cleaned = clean_and_check(make_bowtie(3));
  EXPECT_EQ(cleaned.report.split_vertices, 1U);
  EXPECT_EQ(cleaned.report.split_edges, 0U);
  EXPECT_EQ(components(cleaned.mesh), 2U);
}

TEST(MeshCleaner, JoinsTheFlattestPagesOfABook) {
  // A sheet with a wall on it: the sheet stays whole, the wall comes off.
  const TriangleMesh mesh{{{0, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {1, 0, 0}, {0, 0, 1}}, {{0, 1, 4}, {0, 1, 2}, {1, 0, 3}}};
  const CleanedMesh cleaned = clean_and_check(mesh);
  EXPECT_EQ(cleaned.report.split_edges, 1U);
  EXPECT_EQ(cleaned.report.split_vertices, 2U);
  EXPECT_EQ(components(cleaned.mesh), 2U);
  const std::vector<Triangle>& t = cleaned.mesh.triangles;
  EXPECT_EQ(t[1][0], t[2][1]);
  EXPECT_EQ(t[1][1], t[2][0]);
  EXPECT_NE(t[0][0], t[1][0]);
  for (unsigned pages = 3; pages < 80; ++pages) {
    const CleanedMesh book = clean_and_check(make_book(pages));
    EXPECT_EQ(book.report.split_edges, 1U);
    EXPECT_EQ(components(book.mesh), (pages + 1) / 2) << pages << " pages: all but an odd one stay joined in pairs";
  }
}

TriangleMesh make_cube(const glm::dvec3& low) {
  TriangleMesh cube;
  for (unsigned i = 0; i < 8; ++i) cube.positions.push_back(low + glm::dvec3(i & 1U, i >> 1U & 1U, i >> 2U));
  for (const auto& [a, b, c, d] :
       {std::array<VertexId, 4>{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
    cube.triangles.push_back({a, b, c});
    cube.triangles.push_back({a, c, d});
  }
  return cube;
}

TEST(MeshCleaner, SeparatesSolidsThatTouchAlongAnEdge) {
  TriangleMesh mesh = make_cube({0, 0, 0});
  append(mesh, make_cube({1, 1, 0}), {0, 0, 0});
  const CleanedMesh cleaned = clean_and_check(mesh);
  EXPECT_EQ(cleaned.report.welded_vertices, 2U);
  EXPECT_EQ(cleaned.report.split_edges, 1U);
  EXPECT_EQ(cleaned.report.split_vertices, 2U);
  EXPECT_EQ(cleaned.report.flipped_triangles, 0U);
  EXPECT_EQ(components(cleaned.mesh), 2U);
  // Each solid keeps its twelve faces to itself.
  const TriangleMesh first{cleaned.mesh.positions,
                           {cleaned.mesh.triangles.begin(), cleaned.mesh.triangles.begin() + 12}};
  EXPECT_EQ(components(first), 1 + cleaned.mesh.positions.size() - 8);
}

TEST(MeshCleaner, AClosedFanThatMeetsANeighbourTwiceIsCut) {
  // The projective plane of six vertices: closed, one-sided, every two vertices joined by an edge.
  TriangleMesh mesh{
      {},
      {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}, {0, 5, 1}, {1, 2, 4}, {2, 3, 5}, {3, 4, 1}, {4, 5, 2}, {5, 1, 3}}};
  for (unsigned i = 0; i < 6; ++i) mesh.positions.emplace_back(i, i * i, i * i * i);
  const CleanedMesh cleaned = clean_and_check(mesh);
  EXPECT_GT(cleaned.report.split_edges, 0U);
  EXPECT_EQ(components(cleaned.mesh), 1U) << "cut open, not apart";
}

TEST(MeshCleaner, RandomSoupsBecomeManifoldsThatDrawTheSame) {
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const auto vertices = static_cast<unsigned>(4 + seed % 17 * (1 + seed % 5));
    const auto triangles = static_cast<unsigned>(1 + seed * 7 % 400);
    clean_and_check(make_random_soup(vertices, triangles, seed, seed % 2 == 0));
    if (HasFailure()) return;
  }
}

TEST(MeshCleaner, CrowdedVerticesAndEdgesTakeLinearTime) {
  // 50,000 pages at one edge and a hub that 50,000 random edges surround: quadratic work would not end in time.
  EXPECT_EQ(components(clean_and_check(make_book(50'001)).mesh), 25'001U);
  TriangleMesh hub = make_random_soup(2000, 50'000, 5);
  for (Triangle& t : hub.triangles) t[0] = 0;
  clean_and_check(hub);
}

TEST(MeshCleaner, ReportNamesEveryCount) {
  const RepairReport report{1, 2, 3, 4, 5, 6, 7};
  const auto counts = named_counts(report);
  ASSERT_EQ(counts.size() * sizeof(std::uint64_t), sizeof(RepairReport)) << "a count has no name";
  for (std::size_t i = 0; i < counts.size(); ++i) EXPECT_EQ(counts[i].second, i + 1);
  EXPECT_EQ(counts[0].first, "welded_vertices");
  EXPECT_EQ(counts[6].first, "split_vertices");
}

}  // namespace
}  // namespace fanstream
