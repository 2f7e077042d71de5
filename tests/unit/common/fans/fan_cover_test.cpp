#include "common/fans/fan_cover.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "common/fans/cover_search.h"
#include "common/fans/paper_cover.h"
#include "tests/support/fan_test_meshes.h"

namespace fanstream {
namespace {

struct Case {
  std::string name;
  TriangleMesh mesh;
};

std::vector<Case> cases() {
  std::vector<Case> all = {
      {"nothing", {}},
      {"one triangle", {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{2, 0, 1}}}},
      {"two triangles back to back", {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}}},
      {"tetrahedron", test::make_tetrahedron()},
      {"octahedron", test::make_octahedron()},
      {"double cone", test::make_double_cone(1000)},
      {"torus", test::make_torus(30, 24)},
      {"smallest torus", test::make_torus(3, 3)},
      {"torus with holes", test::punch_holes(test::make_torus(40, 31), 5)},
      {"two components", test::join(test::make_torus(9, 9), test::make_double_cone(7), {9, 0, 0})}};
  for (std::uint32_t seed = 1; seed <= 12; ++seed) {
    const TriangleMesh sphere = test::make_random_sphere(seed < 8 ? 3 + 2 * seed : 100 * seed, seed);
    all.push_back({"random sphere, seed " + std::to_string(seed), sphere});
    all.push_back({"random sphere with holes, seed " + std::to_string(seed), test::punch_holes(sphere, seed)});
  }
  return all;
}

std::size_t used_vertices(const TriangleMesh& mesh) {
  std::set<VertexId> used;
  for (const Triangle& triangle : mesh.triangles) used.insert(triangle.begin(), triangle.end());
  return used.size();
}

constexpr CoverMethod kMethods[] = {CoverMethod::paper, CoverMethod::greedy, CoverMethod::best};

TEST(FanCover, HoldsEveryTriangleOnceTheRightWayRound) {
  for (const Case& c : cases()) {
    for (const CoverMethod method : kMethods) {
      SCOPED_TRACE(c.name + ", method " + std::to_string(static_cast<int>(method)));
      const auto fans = cover_with_fans(c.mesh.positions.size(), c.mesh.triangles, method);
      ASSERT_TRUE(fans) << fans.error().message;
      const auto checked = check_cover(c.mesh.triangles, *fans);
      EXPECT_TRUE(checked) << checked.error().message;
      const FanStatistics statistics = fan_statistics(c.mesh.positions.size(), *fans);
      EXPECT_EQ(statistics.faces, c.mesh.triangles.size());
      std::size_t drawn = 0;
      for (const Fan& fan : fans->fans) drawn += 1 + fan.count + (fan.closed ? 1 : 0);
      EXPECT_EQ(statistics.issued_vertices, drawn);
    }
  }
}

TEST(FanCover, IssuesAtMost2Point9VerticesPerVertex) {
  for (const Case& c : cases()) {
    if (c.mesh.positions.size() < 30) continue;
    SCOPED_TRACE(c.name);
    const auto fans = cover_with_fans(c.mesh.positions.size(), c.mesh.triangles);
    ASSERT_TRUE(fans);
    EXPECT_LE(fan_statistics(used_vertices(c.mesh), *fans).issued_per_vertex(), 2.9);
  }
}

TEST(FanCover, OfARegularMeshIsNearTheOptimum) {
  const TriangleMesh mesh = test::make_torus(60, 60);
  const auto fans = cover_with_fans(mesh.positions.size(), mesh.triangles);
  ASSERT_TRUE(fans);
  const double issued = fan_statistics(mesh.positions.size(), *fans).issued_per_vertex();
  EXPECT_LE(issued, 2.70);
  EXPECT_GE(issued, 8.0 / 3.0);
}

TEST(FanCover, OfADoubleConeIsItsTwoApexes) {
  const TriangleMesh mesh = test::make_double_cone(500);
  for (const CoverMethod method : {CoverMethod::greedy, CoverMethod::best}) {
    const auto fans = cover_with_fans(mesh.positions.size(), mesh.triangles, method);
    ASSERT_TRUE(fans);
    ASSERT_EQ(fans->fans.size(), 2U);
    EXPECT_TRUE(fans->fans[0].closed && fans->fans[1].closed);
  }
}

// The fewest fans of any assignment of faces to their corners.
std::size_t fewest_fans(const TriangleMesh& mesh) {
  const auto stars = VertexStars::build(mesh.positions.size(), mesh.triangles);
  FaceOwners owners(mesh.triangles.size());
  std::size_t combinations = 1;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) combinations *= 3;
  std::size_t fewest = mesh.triangles.size();
  for (std::size_t code = 0; code < combinations; ++code) {
    std::size_t rest = code;
    for (std::size_t face = 0; face < owners.size(); ++face, rest /= 3) owners[face] = mesh.triangles[face][rest % 3];
    fewest = std::min(fewest, fans_of(*stars, owners).fans.size());
  }
  return fewest;
}

TEST(FanCover, MakesTheMostOfAVertexOfHugeValence) {
  // A hub of 300 faces inside seven rings; the vertices of all but the first and last ring have six.
  constexpr std::uint32_t kSides = 300;
  std::vector<Triangle> triangles;
  const auto ring = [](std::uint32_t which, std::uint32_t i) { return 1 + which * kSides + i % kSides; };
  for (std::uint32_t i = 0; i < kSides; ++i) {
    triangles.push_back({0, ring(0, i), ring(0, i + 1)});
    for (std::uint32_t which = 0; which < 6; ++which) {
      triangles.push_back({ring(which, i), ring(which + 1, i), ring(which, i + 1)});
      triangles.push_back({ring(which, i + 1), ring(which + 1, i), ring(which + 1, i + 1)});
    }
  }
  const auto greedy = cover_with_fans(1 + 7 * kSides, triangles, CoverMethod::greedy);
  ASSERT_TRUE(greedy);
  EXPECT_EQ(greedy->fans[0].center, 0U);
  EXPECT_TRUE(greedy->fans[0].closed);
  const auto best = cover_with_fans(1 + 7 * kSides, triangles, CoverMethod::best);
  ASSERT_TRUE(best);
  EXPECT_LE(fan_statistics(1 + 7 * kSides, *best).issued_per_vertex(), 2.75);
}

TEST(FanCover, OfTinyMeshesIsAtMostOneFanAboveTheFewestPossible) {
  std::vector<Case> tiny = {{"tetrahedron", test::make_tetrahedron()}, {"octahedron", test::make_octahedron()}};
  for (std::uint32_t seed = 1; seed <= 8; ++seed) {
    tiny.push_back({"sphere of 6, seed " + std::to_string(seed), test::make_random_sphere(6, seed)});
    tiny.push_back({"sphere of 7 with holes, seed " + std::to_string(seed),
                    test::punch_holes(test::make_random_sphere(7, seed), seed)});
  }
  std::size_t above = 0;
  for (const Case& c : tiny) {
    SCOPED_TRACE(c.name);
    const auto fans = cover_with_fans(c.mesh.positions.size(), c.mesh.triangles);
    ASSERT_TRUE(fans);
    const std::size_t fewest = fewest_fans(c.mesh);
    EXPECT_GE(fans->fans.size(), fewest);
    EXPECT_LE(fans->fans.size(), fewest + 1);
    above += fans->fans.size() - fewest;
  }
  EXPECT_LE(above, 2U) << "of " << tiny.size() << " meshes";
}

TEST(FanCover, SearchingForCentresLeavesAtMostAsManyFans) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const auto stars = VertexStars::build(c.mesh.positions.size(), c.mesh.triangles);
    ASSERT_TRUE(stars);
    FaceOwners owners = greedy_owners(*stars);
    for (const std::size_t steps : {0U, 1U, 10U, 1000U}) {
      const std::size_t before = fans_of(*stars, owners).fans.size();
      search_centers(*stars, {steps, 1, 2}, owners);
      const FanMesh fans = fans_of(*stars, owners);
      EXPECT_LE(fans.fans.size(), before) << steps << " steps";
      EXPECT_EQ(fan_statistics(0, fans).faces, c.mesh.triangles.size());
      EXPECT_TRUE(check_cover(c.mesh.triangles, fans)) << steps << " steps";
    }
  }
}

TEST(FaceOwners, AreCountedAsTheFansTheyMake) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const auto stars = VertexStars::build(c.mesh.positions.size(), c.mesh.triangles);
    ASSERT_TRUE(stars);
    for (const FaceOwners& owners : {paper_owners(*stars), greedy_owners(*stars)}) {
      EXPECT_EQ(fan_count(*stars, owners), fans_of(*stars, owners).fans.size());
    }
  }
}

TEST(FanCover, EverySweepOfTheSearchLeavesAtMostAsManyFans) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const auto stars = VertexStars::build(c.mesh.positions.size(), c.mesh.triangles);
    ASSERT_TRUE(stars);
    FaceOwners owners(c.mesh.triangles.size());
    for (std::size_t face = 0; face < owners.size(); ++face) owners[face] = c.mesh.triangles[face][face % 3];
    std::size_t before = fans_of(*stars, owners).fans.size();
    for (int sweep = 0; sweep < 8; ++sweep) {
      improve_owners(*stars, 1, owners);
      const std::size_t after = fans_of(*stars, owners).fans.size();
      ASSERT_LE(after, before) << "sweep " << sweep;
      before = after;
    }
  }
}

TEST(PaperCover, LeavesNoThreeCentresMutualNeighboursAndNoTwoClosedFansTogether) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const auto stars = VertexStars::build(c.mesh.positions.size(), c.mesh.triangles);
    ASSERT_TRUE(stars);
    const FaceOwners owners = paper_owners(*stars);
    std::vector<bool> center(c.mesh.positions.size(), false);
    for (const VertexId owner : owners) {
      if (owner != kNone) center[owner] = true;
    }
    for (const Triangle& t : c.mesh.triangles) EXPECT_FALSE(center[t[0]] && center[t[1]] && center[t[2]]);
    const FanMesh fans = fans_of(*stars, owners);
    std::vector<bool> closed(c.mesh.positions.size(), false);
    for (const Fan& fan : fans.fans) closed[fan.center] = closed[fan.center] || fan.closed;
    for (const Fan& fan : fans.fans) {
      if (!fan.closed) continue;
      for (const VertexId neighbour : fans.ring(fan)) EXPECT_FALSE(closed[neighbour]);
    }
  }
}

TEST(PaperCover, SharesContestedFacesAsTheFiguresShow) {
  // A strip around the edge 0-1: two neighbouring centres, wings 2 and 3; both stars open.
  const std::vector<Triangle> triangles = {{0, 1, 2}, {1, 0, 3}, {0, 2, 4}, {0, 4, 3}, {1, 5, 2}, {1, 3, 6}, {1, 6, 5}};
  const auto stars = VertexStars::build(7, triangles);
  ASSERT_TRUE(stars);
  const FaceOwners owners = paper_owners(*stars);
  // Vertex 0 first takes its four faces; vertex 1 brings three of its own, is the smaller, and takes the two at the
  // edge. 2 and 3 are wings. 4 and 5 bring none and take two each from 0 and 1; 2 and 6 are wings of 5.
  EXPECT_EQ(owners, (FaceOwners{1, 1, 4, 4, 5, 1, 5}));
}

TEST(CheckCover, NamesWhatIsWrong) {
  const TriangleMesh mesh = test::make_torus(6, 6);
  const FanMesh good = *cover_with_fans(mesh.positions.size(), mesh.triangles);
  const auto complaint = [&](auto&& damage) {
    FanMesh bad = good;
    damage(bad);
    const auto checked = check_cover(mesh.triangles, bad);
    return checked ? std::string() : checked.error().message;
  };
  EXPECT_NE(complaint([](FanMesh& m) { m.fans.pop_back(); }).find("in no fan"), std::string::npos);
  EXPECT_NE(complaint([](FanMesh& m) { m.fans.push_back(m.fans.back()); }), "");
  EXPECT_NE(complaint([](FanMesh& m) { m.fans[0].first = 0xFFFFFFFF; }).find("fan 0"), std::string::npos);
  EXPECT_NE(complaint([](FanMesh& m) { m.fans[1].count = 0xFFFFFFFF; }).find("fan 1"), std::string::npos);
  EXPECT_NE(complaint([](FanMesh& m) { m.fans[0].closed = !m.fans[0].closed; }), "");
  EXPECT_NE(complaint([](FanMesh& m) { std::reverse(m.rings.begin(), m.rings.end()); }), "");
  EXPECT_NE(complaint([](FanMesh& m) {
              const auto closed = std::find_if(m.fans.begin(), m.fans.end(), [](const Fan& f) { return f.closed; });
              const auto first = static_cast<std::uint32_t>(m.rings.size());
              for (std::uint32_t i = 0; i <= closed->count; ++i) {
                m.rings.push_back(m.rings[closed->first + i % closed->count]);
              }
              *closed = {closed->center, first, closed->count + 1, false};
            }).find("not marked closed"),
            std::string::npos);
}

TEST(VertexStars, RejectWhatIsNoManifold) {
  const auto complaint = [](std::size_t vertex_count, std::vector<Triangle> triangles) {
    const auto fans = cover_with_fans(vertex_count, triangles);
    return fans ? std::string() : fans.error().message;
  };
  EXPECT_NE(complaint(3, {{0, 1, 3}}).find("face 0 names vertex 3 of 3"), std::string::npos);
  EXPECT_NE(complaint(3, {{0, 1, 2}, {0, 1, 1}}).find("face 1 uses a vertex twice"), std::string::npos);
  EXPECT_NE(complaint(4, {{0, 1, 2}, {0, 1, 3}}).find("vertex 0"), std::string::npos) << "same direction";
  EXPECT_NE(complaint(5, {{0, 1, 2}, {0, 3, 4}}).find("vertex 0"), std::string::npos) << "bow-tie";
  EXPECT_NE(complaint(5, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}).find("vertex 0"), std::string::npos) << "three at an edge";
  TriangleMesh two = test::join(test::make_tetrahedron(), test::make_tetrahedron(), {3, 0, 0});
  for (Triangle& triangle : two.triangles) {
    for (VertexId& vertex : triangle) vertex = vertex == 4 ? 0 : vertex;
  }
  EXPECT_NE(complaint(8, two.triangles).find("vertex 0"), std::string::npos) << "two closed stars";
  EXPECT_EQ(complaint(9, test::make_tetrahedron().triangles), "") << "unused vertices are harmless";
}

TEST(VertexStars, KnowTheFaceAcrossEveryEdge) {
  const TriangleMesh mesh = test::punch_holes(test::make_random_sphere(200, 3), 4);
  const auto stars = VertexStars::build(mesh.positions.size(), mesh.triangles);
  ASSERT_TRUE(stars);
  std::size_t boundary = 0;
  for (CornerId corner = 0; corner < 3 * mesh.triangles.size(); ++corner) {
    const FaceId across = stars->face_across(corner);
    if (across == kNone) {
      ++boundary;
      continue;
    }
    const VertexId a = stars->vertex(next_corner(corner));
    const VertexId b = stars->vertex(previous_corner(corner));
    const Triangle& other = mesh.triangles[across];
    const std::size_t at = static_cast<std::size_t>(std::find(other.begin(), other.end(), b) - other.begin());
    ASSERT_LT(at, 3U);
    EXPECT_EQ(other[(at + 1) % 3], a);
  }
  std::size_t open = 0;
  for (VertexId vertex = 0; vertex < mesh.positions.size(); ++vertex) {
    open += !stars->star(vertex).empty() && !stars->closed(vertex) ? 1 : 0;
  }
  EXPECT_GT(boundary, 0U);
  EXPECT_EQ(boundary, open);
}

}  // namespace
}  // namespace fanstream
