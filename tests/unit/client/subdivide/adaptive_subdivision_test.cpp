#include "client/subdivide/adaptive_subdivision.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>

#include "tests/support/mesh_generators.h"
#include "tests/support/polygon_meshes.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using namespace fanstream::testing;

using Marks = std::vector<std::uint8_t>;

// Finds points again to rounding.
class PointIndex {
 public:
  static constexpr double kCell = 1e-9;
  void add(const glm::dvec4& point) { cells_[key(point, 0, 0, 0)].push_back(point); }
  bool has(const glm::dvec4& point) const {
    for (int i = 0; i < 27; ++i) {
      const auto cell = cells_.find(key(point, i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
      if (cell == cells_.end()) continue;
      for (const glm::dvec4& other : cell->second) {
        const glm::dvec4 d = other - point;
        if (std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z), std::abs(d.w)}) < 1e-13) return true;
      }
    }
    return false;
  }

 private:
  static std::uint64_t key(const glm::dvec4& p, int dx, int dy, int dz) {
    const auto cell = [](double x, int d) { return static_cast<std::uint64_t>(std::llround(x / kCell) + d); };
    return cell(p.x, dx) * 0x9E3779B97F4A7C15U ^ cell(p.y, dy) * 0xC2B2AE3D27D4EB4FU ^
           cell(p.z, dz) * 0x165667B19E3779F9U;
  }
  std::unordered_map<std::uint64_t, std::vector<glm::dvec4>> cells_;
};

PointIndex index_of(const PolygonMesh& mesh) {
  PointIndex index;
  for (const glm::dvec4& point : mesh.points) index.add(point);
  return index;
}

struct Topology {
  std::size_t boundary_edges = 0;
  long euler = 0;  // used vertices - edges + faces
};

// Edges with exactly one face are counted; more than two, or faces that disagree, would fail check_polygons.
Topology topology_of(const PolygonMesh& mesh) {
  std::set<std::pair<VertexId, VertexId>> directed;
  std::set<VertexId> used;
  for (FaceId f = 0; f < mesh.face_count(); ++f) {
    const auto face = mesh.face(f);
    for (std::size_t i = 0; i < face.size(); ++i) {
      EXPECT_TRUE(directed.insert({face[i], face[(i + 1) % face.size()]}).second);
      used.insert(face[i]);
    }
  }
  Topology result;
  std::size_t edges = 0;
  for (const auto& [a, b] : directed) {
    const bool paired = directed.contains({b, a});
    result.boundary_edges += paired ? 0 : 1;
    edges += paired && a > b ? 0 : 1;
  }
  result.euler = static_cast<long>(used.size()) - static_cast<long>(edges) + static_cast<long>(mesh.face_count());
  return result;
}

PolygonMesh closed_mesh(std::uint64_t seed) {
  const TriangleMesh base = seed % 2 == 0 ? make_sphere(7, 11) : make_torus(9, 6);
  return jittered(with_dissolved_edges(polygon_mesh(base), 0.4, seed), 0.05, seed);
}
PolygonMesh open_mesh(std::uint64_t seed) {
  return jittered(with_dissolved_edges(polygon_mesh(make_terrain(8, 6, seed)), 0.3, seed), 0.1, seed);
}

// Faces near a random point, or all but these, as views choose them; or single faces here and there.
Marks random_choice(const AdaptiveSubdivision& mesh, SeededRandom& random) {
  Marks marks(mesh.active_count(), 0);
  if (mesh.active_count() == 0) return marks;
  const std::uint32_t kind = random.below(3);
  const glm::dvec3 center = position(mesh.points()[mesh.active_face(random.below(mesh.active_count()))[0]]);
  for (FaceId f = 0; f < mesh.active_count(); ++f) {
    const glm::dvec3 d = position(mesh.points()[mesh.active_face(f)[0]]) - center;
    const double distance = std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
    marks[f] = kind == 0 ? distance < 1.2 : kind == 1 ? distance > 0.3 : random.unit() < 0.9;
  }
  return marks;
}

AdaptiveSubdivision start(const PolygonMesh& mesh, BoundaryRule rule = BoundaryRule::corners) {
  Result<AdaptiveSubdivision> created = AdaptiveSubdivision::create(mesh, {rule});
  EXPECT_TRUE(created) << created.error().message;
  return std::move(*created);
}

class RandomChoices : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(RandomChoices, EveryEdgeOfAClosedMeshHasTwoFaces) {
  const PolygonMesh mesh = closed_mesh(GetParam());
  SeededRandom random(GetParam());
  AdaptiveSubdivision refined = start(mesh);
  const long euler = topology_of(mesh).euler;
  for (unsigned depth = 1; depth <= 7; ++depth) {
    ASSERT_TRUE(refined.refine(random_choice(refined, random)));
    const AdaptiveMesh result = refined.result();
    const Result<void> checked = check_polygons(result.mesh);
    ASSERT_TRUE(checked) << "seed " << GetParam() << " depth " << depth << ": " << checked.error().message;
    const Topology topology = topology_of(result.mesh);
    EXPECT_EQ(topology.boundary_edges, 0U) << "seed " << GetParam() << " depth " << depth;
    EXPECT_EQ(topology.euler, euler) << "seed " << GetParam() << " depth " << depth;
    EXPECT_EQ(result.face_depths.size(), result.mesh.face_count());
    EXPECT_EQ(result.face_origins.size(), result.mesh.face_count());
    EXPECT_EQ(refined.face_count(), result.mesh.face_count());
  }
}

TEST_P(RandomChoices, AnOpenMeshEndsWhereItEnded) {
  const PolygonMesh mesh = open_mesh(GetParam());
  SeededRandom random(GetParam());
  AdaptiveSubdivision refined = start(mesh);
  const long euler = topology_of(mesh).euler;
  std::size_t boundary_before = topology_of(mesh).boundary_edges;
  for (unsigned depth = 1; depth <= 6; ++depth) {
    ASSERT_TRUE(refined.refine(random_choice(refined, random)));
    const AdaptiveMesh result = refined.result();
    ASSERT_TRUE(check_polygons(result.mesh)) << "seed " << GetParam();
    const Topology topology = topology_of(result.mesh);
    EXPECT_EQ(topology.euler, euler) << "seed " << GetParam() << " depth " << depth;
    EXPECT_GE(topology.boundary_edges, boundary_before);
    if (depth % 2 == 1) {
      EXPECT_EQ(topology.boundary_edges, boundary_before);
    }
    boundary_before = topology.boundary_edges;
  }
}

// What is said in the header: refined vertices are exact.
TEST_P(RandomChoices, EveryVertexIsOneOfSomeUniformRefinement) {
  for (const BoundaryRule rule : {BoundaryRule::smooth, BoundaryRule::corners}) {
    const PolygonMesh mesh = GetParam() % 2 == 0 ? closed_mesh(GetParam()) : open_mesh(GetParam());
    std::vector<PointIndex> uniform;
    for (unsigned depth = 0; depth <= 6; depth += 2) uniform.push_back(index_of(*subdivide(mesh, depth, {rule})));
    SeededRandom random(GetParam() + 100);
    AdaptiveSubdivision refined = start(mesh, rule);
    for (unsigned depth = 1; depth <= 6; ++depth) {
      Marks marks = depth < 4 ? Marks(refined.active_count(), 1) : random_choice(refined, random);
      if (depth < 4 && !marks.empty()) marks[random.below(marks.size())] = 0;
      if (random.one_in(2)) refined.add_support(marks);
      ASSERT_TRUE(refined.refine(marks));
    }
    EXPECT_GT(refined.active_count(), 0U) << "seed " << GetParam();
    for (const glm::dvec4& point : refined.points()) {
      const bool found = std::any_of(uniform.begin(), uniform.end(), [&](const PointIndex& i) { return i.has(point); });
      ASSERT_TRUE(found) << "seed " << GetParam() << ": " << point.x << " " << point.y << " " << point.z;
    }
  }
}

TEST_P(RandomChoices, WithSupportNoChosenFaceIsLost) {
  const PolygonMesh mesh = GetParam() % 2 == 0 ? closed_mesh(GetParam()) : open_mesh(GetParam());
  SeededRandom random(GetParam() + 7);
  AdaptiveSubdivision refined = start(mesh);
  Marks chosen = random_choice(refined, random);
  for (unsigned step = 0; step < 3; ++step) {
    // Two half-steps; afterwards the chosen faces' centres are known by their place in the list of points.
    for (FaceId f = 0; f < chosen.size(); ++f) chosen[f] &= refined.refinable(f) ? 1 : 0;
    Marks supported = chosen;
    refined.add_support(supported);
    std::set<VertexId> centers;
    auto center = static_cast<VertexId>(refined.points().size());
    for (FaceId f = 0; f < supported.size(); ++f) {
      if (supported[f] == 0 || !refined.refinable(f)) continue;
      if (chosen[f] != 0) centers.insert(center);
      ++center;
    }
    ASSERT_TRUE(refined.refine(supported));
    // Of the quads only some, so that the rule before even steps is put to the test too.
    Marks some(refined.active_count(), 0);
    for (FaceId f = 0; f < some.size(); ++f) some[f] = random.one_in(2) ? 0 : 1;
    Marks with_support = some;
    refined.add_support(with_support);
    std::set<VertexId> chosen_quads;
    center = static_cast<VertexId>(refined.points().size());
    for (FaceId f = 0; f < some.size(); ++f) {
      if (some[f] != 0) chosen_quads.insert(center);
      center += with_support[f] != 0 ? 1 : 0;
    }
    ASSERT_TRUE(refined.refine(with_support));
    chosen.assign(refined.active_count(), 0);
    for (FaceId f = 0; f < refined.active_count(); ++f) {
      const auto face = refined.active_face(f);
      const auto in = [&](const std::set<VertexId>& set) {
        return std::any_of(face.begin(), face.end(), [&](VertexId v) { return set.contains(v); });
      };
      if (!in(centers) || !in(chosen_quads)) continue;
      EXPECT_TRUE(refined.refinable(f)) << "seed " << GetParam() << " step " << step;
      chosen[f] = 1;
    }
  }
  EXPECT_GT(std::count(chosen.begin(), chosen.end(), 1), 0) << "seed " << GetParam();
}

INSTANTIATE_TEST_SUITE_P(AdaptiveSubdivision, RandomChoices, ::testing::Range(std::uint64_t{0}, std::uint64_t{12}));

TEST(AdaptiveSubdivision, AllFacesChosenIsUniformRefinementAtEveryDepth) {
  for (const BoundaryRule rule : {BoundaryRule::smooth, BoundaryRule::corners}) {
    for (const PolygonMesh& mesh : {closed_mesh(4), closed_mesh(5), with_random_weights(open_mesh(6), 3)}) {
      AdaptiveSubdivision refined = start(mesh, rule);
      for (unsigned depth = 1; depth <= 6; ++depth) {
        ASSERT_TRUE(refined.refine(Marks(refined.active_count(), 1)));
        const Result<PolygonMesh> uniform = subdivide(mesh, depth, {rule});
        ASSERT_TRUE(uniform);
        const AdaptiveMesh result = refined.result();
        ASSERT_EQ(result.mesh.face_count(), uniform->face_count());
        ASSERT_EQ(result.mesh.points.size(), uniform->points.size());
        EXPECT_EQ(result.mesh.corners.size(), uniform->corners.size());
        const PointIndex index = index_of(*uniform);
        for (const glm::dvec4& point : result.mesh.points) ASSERT_TRUE(index.has(point)) << "depth " << depth;
        // Faces by their centroids.
        const auto centroid = [](const PolygonMesh& m, FaceId f) {
          glm::dvec4 sum(0);
          for (const VertexId v : m.face(f)) sum += m.points[v] / static_cast<double>(m.face(f).size());
          return sum;
        };
        PointIndex centroids;
        for (FaceId f = 0; f < uniform->face_count(); ++f) centroids.add(centroid(*uniform, f));
        for (FaceId f = 0; f < result.mesh.face_count(); ++f) {
          ASSERT_TRUE(centroids.has(centroid(result.mesh, f))) << "depth " << depth;
          ASSERT_EQ(result.face_depths[f], depth);
        }
      }
    }
  }
}

TEST(AdaptiveSubdivision, NothingChosenLeavesTheMesh) {
  const PolygonMesh mesh = closed_mesh(1);
  AdaptiveSubdivision refined = start(mesh);
  ASSERT_TRUE(refined.refine(Marks(mesh.face_count(), 0)));
  ASSERT_TRUE(refined.refine(Marks(0)));
  const AdaptiveMesh result = refined.result();
  EXPECT_EQ(result.mesh.points, mesh.points);
  EXPECT_EQ(result.mesh.corners, mesh.corners);
  EXPECT_EQ(result.mesh.face_begins, mesh.face_begins);
  EXPECT_EQ(result.face_depths, std::vector<std::uint8_t>(mesh.face_count(), 0));
}

// One face of a cube: its centre, four fillers, no more; then nothing can go on.
TEST(AdaptiveSubdivision, AFaceAloneBecomesAFanOfTriangles) {
  AdaptiveSubdivision refined = start(make_cube());
  ASSERT_TRUE(refined.refine(Marks{0, 1, 0, 0, 0, 0}));
  EXPECT_EQ(refined.active_count(), 0U);
  const AdaptiveMesh result = refined.result();
  EXPECT_EQ(result.mesh.face_count(), 9U);
  EXPECT_EQ(std::count(result.face_origins.begin(), result.face_origins.end(), 1U), 4);
  EXPECT_EQ(std::count(result.face_depths.begin(), result.face_depths.end(), 1), 4);
  EXPECT_EQ(result.mesh.points[8], glm::dvec4(0, 0, 1, 1));
  // The corners have moved to where Catmull-Clark has them, for the five other faces too.
  EXPECT_NEAR(result.mesh.points[7].x, 5.0 / 9.0, 1e-15);
  EXPECT_EQ(result.mesh.points[0], glm::dvec4(-1, -1, -1, 1));
}

// Around a chosen pair, the old edges to the other faces stay.
TEST(AdaptiveSubdivision, TwoFacesGiveOneQuadAndFillers) {
  AdaptiveSubdivision refined = start(make_cube());
  ASSERT_TRUE(refined.refine(Marks{0, 1, 0, 1, 0, 0}));
  ASSERT_EQ(refined.active_count(), 1U);
  EXPECT_EQ(refined.active_face(0).size(), 4U);
  EXPECT_EQ(refined.result().mesh.face_count(), 4U + 6U + 1U);
  EXPECT_TRUE(refined.refinable(0));
  ASSERT_TRUE(refined.refine(Marks{1}));
  EXPECT_EQ(refined.active_count(), 0U);
  EXPECT_EQ(refined.result().mesh.face_count(), 4U + 6U + 4U);
}

TEST(AdaptiveSubdivision, RefusesTooMuchAndIsAsBefore) {
  SubdivisionOptions options;
  options.max_corners = 50;
  Result<AdaptiveSubdivision> refined = AdaptiveSubdivision::create(make_cube(), options);
  ASSERT_TRUE(refined);
  ASSERT_TRUE(refined->refine(Marks(6, 1)));
  const AdaptiveMesh before = refined->result();
  const Result<void> refused = refined->refine(Marks(12, 1));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::limit);
  EXPECT_EQ(refined->result().mesh.corners, before.mesh.corners);
  EXPECT_EQ(refined->result().mesh.points, before.mesh.points);
  EXPECT_EQ(refined->depth(), 1U);
  const Result<void> wrong = refined->refine(Marks(11, 1));
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().kind, ErrorKind::usage);
}

}  // namespace
}  // namespace fanstream
