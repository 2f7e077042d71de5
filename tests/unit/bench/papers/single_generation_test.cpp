#include "tests/bench/papers/single_generation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <map>
#include <set>

#include "common/fans/fan_cover.h"
#include "tests/bench/papers/ellipsoid.h"
#include "tests/support/fan_test_meshes.h"

namespace fanstream::bench {
namespace {

struct Case {
  std::string name;
  TriangleMesh mesh;
};

std::vector<Case> cases() {
  return {{"ellipsoid of rings", make_ring_ellipsoid()},
          {"ellipsoid of eight sides", make_octahedral_ellipsoid()},
          {"random sphere, seed 5", test::make_random_sphere(400, 5)},
          {"random sphere with holes, seed 6", test::punch_holes(test::make_random_sphere(500, 6), 6)},
          {"torus", test::make_torus(14, 10)},
          {"octahedron", test::make_octahedron()}};
}

const CostOptions kPaperCost{CostKind::fans, Placement::ends_middle, {}, {}, {}, {}, 1};

std::unique_ptr<SingleGeneration> build(const TriangleMesh& mesh, const CostOptions& cost = kPaperCost) {
  auto made = SingleGeneration::build(mesh, cost);
  EXPECT_TRUE(made) << made.error().message;
  return std::move(*made);
}

Triangle rotated(Triangle t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

// The fans of a level as lists of faces, in the original's numbers.
std::set<std::vector<Triangle>> faces_by_fan(const SingleGeneration& generation) {
  const std::vector<VertexId> vertices = generation.vertices();
  const FanMesh mesh = generation.fans();
  std::set<std::vector<Triangle>> result;
  for (const Fan& fan : mesh.fans) {
    const auto ring = mesh.ring(fan);
    std::vector<Triangle> faces;
    for (std::size_t i = 0; i < fan.face_count(); ++i) {
      faces.push_back(rotated({vertices[fan.center], vertices[ring[i]], vertices[ring[(i + 1) % ring.size()]]}));
    }
    std::sort(faces.begin(), faces.end());
    result.insert(faces);
  }
  return result;
}

bool has(const Triangle& t, VertexId v) { return std::find(t.begin(), t.end(), v) != t.end(); }

TEST(SingleGeneration, EachLevelHasOneFanAndOneVertexMoreThanTheOneBelow) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const auto generation = build(c.mesh);
    generation->go_to(0);
    const std::size_t fans = generation->fans().fans.size();
    const std::size_t vertices = generation->mesh().positions.size();
    for (std::size_t level = 0; level < generation->level_count(); ++level) {
      generation->go_to(level);
      ASSERT_EQ(generation->level(), level);
      const TriangleMesh mesh = generation->mesh();
      const FanMesh covered = generation->fans();
      ASSERT_EQ(mesh.positions.size(), vertices + level);
      ASSERT_EQ(covered.fans.size(), fans + level);
      const auto checked = check_cover(mesh.triangles, covered);
      ASSERT_TRUE(checked) << "level " << level << ": " << checked.error().message;
    }
  }
}

TEST(SingleGeneration, TheFinestLevelIsTheMeshAndThePapersConversion) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const auto generation = build(c.mesh);
    generation->go_to(generation->level_count() - 1);
    std::set<Triangle> wanted;
    std::set<Triangle> got;
    for (const Triangle& t : c.mesh.triangles) wanted.insert(rotated(t));
    const std::vector<VertexId> vertices = generation->vertices();
    const TriangleMesh mesh = generation->mesh();
    for (const Triangle& t : mesh.triangles) got.insert(rotated({vertices[t[0]], vertices[t[1]], vertices[t[2]]}));
    EXPECT_EQ(got, wanted);
    for (std::size_t i = 0; i < vertices.size(); ++i) EXPECT_EQ(mesh.positions[i], c.mesh.positions[vertices[i]]);
    const auto cover = cover_with_fans(c.mesh.positions.size(), c.mesh.triangles, CoverMethod::paper);
    ASSERT_TRUE(cover);
    EXPECT_EQ(generation->fans().fans.size(), cover->fans.size());
  }
}

// Where a split adds an ear to a boundary, the other of the two fans is what the parent's was.
TEST(SingleGeneration, EachSplitTouchesOneFanOnly) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const auto generation = build(c.mesh);
    generation->go_to(0);
    std::set<std::vector<Triangle>> coarse = faces_by_fan(*generation);
    for (std::size_t level = 1; level < generation->level_count(); ++level) {
      generation->go_to(level);
      std::set<std::vector<Triangle>> fine = faces_by_fan(*generation);
      std::vector<std::vector<Triangle>> gone;
      std::vector<std::vector<Triangle>> came;
      std::set_difference(coarse.begin(), coarse.end(), fine.begin(), fine.end(), std::back_inserter(gone));
      std::set_difference(fine.begin(), fine.end(), coarse.begin(), coarse.end(), std::back_inserter(came));
      ASSERT_LE(gone.size(), 1U) << "level " << level;
      ASSERT_EQ(came.size(), gone.size() + 1) << "level " << level;
      const VertexId root = generation->split_after(level - 1).root;
      for (const auto& fan : gone) {
        EXPECT_TRUE(std::all_of(fan.begin(), fan.end(), [&](const Triangle& t) { return has(t, root); }));
      }
      coarse = std::move(fine);
    }
  }
}

// Counted from the fans themselves: the two that a split leaves are neighbours, and hold every face around either
// centre.
TEST(SingleGeneration, EveryMergeObeysTheTwoConditions) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const auto generation = build(c.mesh);
    for (std::size_t level = 1; level < generation->level_count(); ++level) {
      const SingleGeneration::Split split = generation->split_after(level - 1);
      generation->go_to(level);
      EXPECT_TRUE(generation->conditions_hold(split.root, split.added)) << "level " << level;
      const std::vector<VertexId> vertices = generation->vertices();
      const auto number = [&](VertexId v) {
        return static_cast<VertexId>(std::lower_bound(vertices.begin(), vertices.end(), v) - vertices.begin());
      };
      const VertexId root = number(split.root);
      const VertexId added = number(split.added);
      std::size_t around = 0;
      std::size_t between = 0;
      for (const Triangle& t : generation->mesh().triangles) {
        around += has(t, root) || has(t, added) ? 1 : 0;
        between += has(t, root) && has(t, added) ? 1 : 0;
      }
      std::size_t held = 0;
      std::size_t fans = 0;
      for (const Fan& fan : generation->fans().fans) {
        if (fan.center != root && fan.center != added) continue;
        held += fan.face_count();
        ++fans;
      }
      ASSERT_EQ(fans, 2U) << "level " << level;
      EXPECT_EQ(held, around) << "level " << level;
      EXPECT_GE(between, 1U) << "level " << level;
    }
  }
}

TEST(SingleGeneration, TwoFansWithAThirdBetweenThemMayNotMerge) {
  const auto generation = build(make_ring_ellipsoid());
  generation->go_to(generation->level_count() - 1);
  EXPECT_FALSE(generation->conditions_hold(0, 401)) << "the poles are no neighbours";
  EXPECT_FALSE(generation->conditions_hold(7, 7));
  // Wherever the conditions hold for two centres, no other centre owns a face around them.
  const std::vector<VertexId> all = generation->vertices();
  const FanMesh fans = generation->fans();
  std::size_t holding = 0;
  for (const Triangle& t : generation->mesh().triangles) {
    for (int i = 0; i < 3; ++i) {
      const VertexId a = t[i];
      const VertexId b = t[(i + 1) % 3];
      const bool holds = generation->conditions_hold(all[a], all[b]);
      EXPECT_EQ(holds, generation->conditions_hold(all[b], all[a]));
      bool foreign = false;
      for (const Fan& fan : fans.fans) {
        if (fan.center == a || fan.center == b) continue;
        const auto ring = fans.ring(fan);
        foreign = foreign || std::find(ring.begin(), ring.end(), a) != ring.end() ||
                  std::find(ring.begin(), ring.end(), b) != ring.end();
      }
      EXPECT_EQ(holds, !foreign) << a << ", " << b;
      holding += holds ? 1 : 0;
    }
  }
  EXPECT_GT(holding, 0U);
}

TEST(SingleGeneration, RemovesAboutAsMuchOfARegularEllipsoidAsThePaperTells) {
  const auto generation = build(make_ring_ellipsoid());
  // The paper: 119 of 402 vertices, from 211 fans.
  EXPECT_NEAR(static_cast<double>(generation->level_count() - 1), 119.0, 30.0);
  generation->go_to(generation->level_count() - 1);
  EXPECT_NEAR(static_cast<double>(generation->fans().fans.size()), 211.0, 20.0);
}

// Twice the area of each face, as a vector, by the face's vertices in the original's numbers; faces between `root` and
// `added` left out, and `added` called `root`.
std::map<Triangle, glm::dvec3> areas(const SingleGeneration& generation, const SingleGeneration::Split& split) {
  const std::vector<VertexId> vertices = generation.vertices();
  const TriangleMesh mesh = generation.mesh();
  std::map<Triangle, glm::dvec3> result;
  for (const Triangle& t : mesh.triangles) {
    Triangle named{vertices[t[0]], vertices[t[1]], vertices[t[2]]};
    if (has(named, split.root) && has(named, split.added)) continue;
    std::replace(named.begin(), named.end(), split.added, split.root);
    const glm::dvec3& a = mesh.positions[t[0]];
    result[rotated(named)] = glm::cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
  }
  return result;
}

TEST(SingleGeneration, NoMergeTurnsAFaceOverWhateverTheCost) {
  for (const CostKind cost : {CostKind::fans, CostKind::quadric, CostKind::curvature}) {
    const auto generation = build(make_ring_ellipsoid(), {cost, Placement::ends_middle, {}, {}, {}, {}, 1});
    EXPECT_GT(generation->level_count(), 50U);
    for (std::size_t level = 1; level < generation->level_count(); ++level) {
      const SingleGeneration::Split split = generation->split_after(level - 1);
      generation->go_to(level);
      const std::map<Triangle, glm::dvec3> fine = areas(*generation, split);
      generation->go_to(level - 1);
      const std::map<Triangle, glm::dvec3> coarse = areas(*generation, split);
      ASSERT_EQ(fine.size(), coarse.size());
      for (const auto& [face, area] : coarse) {
        ASSERT_TRUE(fine.contains(face));
        EXPECT_GT(glm::dot(fine.at(face), area), 0.0) << "level " << level;
      }
    }
  }
}

TEST(SingleGeneration, RefusesMeshesAndCostsThatItCannotWorkWith) {
  const TriangleMesh bow_tie{std::vector<glm::dvec3>(5), {{0, 1, 2}, {0, 3, 4}}};
  const auto bad_mesh = SingleGeneration::build(bow_tie, kPaperCost);
  ASSERT_FALSE(bad_mesh);
  EXPECT_EQ(bad_mesh.error().kind, ErrorKind::bad_input);
  CostOptions cost = kPaperCost;
  cost.kappa = -1.0;
  const auto bad_cost = SingleGeneration::build(make_ring_ellipsoid(), cost);
  ASSERT_FALSE(bad_cost);
  EXPECT_EQ(bad_cost.error().kind, ErrorKind::usage);
}

}  // namespace
}  // namespace fanstream::bench
