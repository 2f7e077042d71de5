#include "common/fans/linked_fans.h"

#include <gtest/gtest.h>

#include <set>

#include "common/mesh/manifold_check.h"
#include "tests/support/ring_views.h"
#include "tests/support/seeded_random.h"
#include "tests/unit/common/fans/fan_shapes.h"

namespace fanstream {
namespace {

using testing::as_cycle;
using testing::compact_faces;
using testing::cycles_of;
using testing::fan_shapes;
using testing::SeededRandom;

using Ring = std::vector<VertexId>;

LinkedFans fans_of(const TriangleMesh& mesh, std::size_t room = 0) {
  LinkedFans fans(mesh.positions.size(), mesh.triangles);
  fans.resize(mesh.positions.size() + room);
  return fans;
}

// Where every fan starts, what it spells, and by which corners.
struct Image {
  std::vector<LinkedFans::CornerId> starts;
  std::vector<Ring> rings;
  std::vector<LinkedFans::CornerId> links;
  std::vector<Triangle> faces;
  bool operator==(const Image&) const = default;
};

Image image_of(const LinkedFans& fans) {
  Image image;
  for (VertexId v = 0; v < fans.vertex_capacity(); ++v) {
    image.starts.push_back(fans.corner(v));
    image.rings.push_back(fans.ring(v));
    LinkedFans::CornerId corner = fans.corner(v);
    for (std::uint32_t i = 0; i < fans.ring_size(v); ++i) {
      image.links.push_back(corner);
      corner = fans.corners()[corner].next;
    }
  }
  image.faces = fans.triangles();
  return image;
}

// Fans close, every corner is in one fan, and neighbouring corners agree on the vertex between them.
void expect_linked(const LinkedFans& fans) {
  std::set<LinkedFans::CornerId> seen;
  for (VertexId v = 0; v < fans.vertex_capacity(); ++v) {
    ASSERT_EQ(fans.contains(v), fans.ring_size(v) != 0);
    LinkedFans::CornerId corner = fans.corner(v);
    std::uint32_t outside = 0;
    for (std::uint32_t i = 0; i < fans.ring_size(v); ++i) {
      ASSERT_TRUE(seen.insert(corner).second) << "corner " << corner;
      const LinkedFans::CornerId face = corner & ~3U;
      const LinkedFans::CornerId k = corner & 3U;
      ASSERT_LT(k, 3U);
      ASSERT_EQ(fans.corners()[face + (k + 2) % 3].neighbour, v);
      const LinkedFans::Corner here = fans.corners()[corner];
      ASSERT_EQ(fans.corners()[face + (k + 1) % 3].neighbour, fans.corners()[here.next].neighbour);
      outside += here.neighbour == kOutside ? 1 : 0;
      corner = here.next;
    }
    ASSERT_LE(outside, 1U);
    if (fans.contains(v)) {
      ASSERT_EQ(corner, fans.corner(v)) << "vertex " << v;
    }
  }
}

std::vector<Triangle> sorted_faces(std::vector<Triangle> faces) {
  for (Triangle& t : faces) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  std::sort(faces.begin(), faces.end());
  return faces;
}

TEST(LinkedFans, HoldTheTrianglesTheyWereMadeFrom) {
  for (const auto& [name, mesh] : fan_shapes()) {
    SCOPED_TRACE(name);
    const LinkedFans fans = fans_of(mesh, 7);
    EXPECT_EQ(fans.triangles(), mesh.triangles);
    EXPECT_EQ(fans.triangles(mesh.positions.size()), mesh.triangles) << "no others are in the mesh";
    EXPECT_EQ(fans.triangles(fans.vertex_capacity() + 100'000), mesh.triangles) << "an end beyond all";
    EXPECT_EQ(fans.vertex_capacity(), mesh.positions.size() + 7);
    expect_linked(fans);
    EXPECT_EQ(cycles_of(fans), cycles_of(RingMesh::from_triangles(mesh.positions.size(), mesh.triangles)));
    for (VertexId v = 0; v < mesh.positions.size(); ++v) {
      Ring visited;
      fans.for_each_neighbour(v, [&](VertexId w) { visited.push_back(w); });
      Ring expected = fans.ring(v);
      std::erase(expected, kOutside);
      ASSERT_EQ(visited, expected);
    }
  }
}

struct Split {
  VertexId root, added;
  std::uint32_t first, last;
  LinkedFans::CornerId root_corner;  // before
};

Split random_split(const LinkedFans& fans, VertexId root, VertexId added, SeededRandom& random) {
  const std::uint32_t size = fans.ring_size(root);
  const std::uint32_t first = random.below(size);
  return {root, added, first, (first + 1 + random.below(size - 1)) % size, fans.corner(root)};
}

// Of any vertex of the mesh, the largest fans and boundaries more often.
VertexId random_root(const LinkedFans& fans, std::uint32_t vertices, SeededRandom& random) {
  VertexId root = random.below(vertices);
  for (int i = 0; i < 3; ++i) {
    const VertexId other = random.below(vertices);
    if (fans.ring_size(other) > fans.ring_size(root)) root = other;
  }
  return root;
}

TEST(LinkedFans, SplitsAndMergesAreExactInversesAndAgreeWithRingMesh) {
  for (const auto& [name, mesh] : fan_shapes()) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      SCOPED_TRACE(name + ", seed " + std::to_string(seed));
      SeededRandom random(seed);
      constexpr std::uint32_t kSplits = 60;
      const auto base = static_cast<std::uint32_t>(mesh.positions.size());
      LinkedFans fans = fans_of(mesh, kSplits);
      RingMesh rings = RingMesh::from_triangles(base, mesh.triangles);
      std::vector<std::pair<Split, Image>> made;
      for (VertexId added = base; added < base + kSplits; ++added) {
        const Split s = random_split(fans, random_root(fans, added, random), added, random);
        made.emplace_back(s, image_of(fans));
        const Ring ring = fans.ring(s.root);
        fans.split(s.root, s.added, s.first, s.last);
        rings.split(s.root, s.added, rings.position_in_ring(s.root, ring[s.first]),
                    rings.position_in_ring(s.root, ring[s.last]));
        ASSERT_EQ(cycles_of(fans), cycles_of(rings));
        ASSERT_EQ(sorted_faces(fans.triangles()), sorted_faces(rings.triangles()));
        expect_linked(fans);
        if (HasFatalFailure()) return;
        std::string why;
        ASSERT_TRUE(is_oriented_manifold(compact_faces(fans), &why)) << why;
        // Both start at the first of the new faces.
        ASSERT_EQ(Ring({fans.ring(s.root)[0], fans.ring(s.root)[1]}), Ring({ring[s.first], s.added}));
        ASSERT_EQ(Ring({fans.ring(s.added)[0], fans.ring(s.added)[1]}), Ring({s.root, ring[s.first]}));
      }
      for (; !made.empty(); made.pop_back()) {
        const auto& [s, before] = made.back();
        const RingMesh::Wings expected = rings.wings(s.root, s.added);
        const RingMesh::Wings wings = fans.merge(s.root, s.added, s.root_corner);
        rings.merge(s.root, s.added);
        ASSERT_EQ(wings.first, expected.first);
        ASSERT_EQ(wings.last, expected.last);
        ASSERT_TRUE(image_of(fans) == before) << "split " << made.size();
        ASSERT_FALSE(fans.contains(s.added));
      }
    }
  }
}

// Splits of roots of which none is another's neighbour, each root's in their order.
std::vector<std::vector<Split>> independent_splits(const LinkedFans& fans, VertexId first_added, std::size_t most,
                                                   SeededRandom& random) {
  LinkedFans scratch = fans;  // a later split of a root is told by its ring after those before
  Ring candidates;
  for (VertexId v = 0; v < first_added; ++v) candidates.push_back(v);
  random.shuffle(candidates);
  std::set<VertexId> closed;
  std::vector<std::vector<Split>> by_root;
  VertexId added = first_added;
  for (const VertexId root : candidates) {
    if (closed.contains(root) || by_root.size() == most) continue;
    fans.for_each_neighbour(root, [&](VertexId w) { closed.insert(w); });
    by_root.emplace_back();
    for (std::uint32_t n = 1 + random.below(3); n > 0; --n) {
      by_root.back().push_back(random_split(scratch, root, added, random));
      scratch.split(root, added, by_root.back().back().first, by_root.back().back().last);
      ++added;
    }
  }
  return by_root;
}

// Which root's turn it is, each as often as it has splits.
std::vector<std::size_t> random_turns(const std::vector<std::vector<Split>>& by_root, SeededRandom& random) {
  std::vector<std::size_t> turns;
  for (std::size_t r = 0; r < by_root.size(); ++r) turns.insert(turns.end(), by_root[r].size(), r);
  random.shuffle(turns);
  return turns;
}

TEST(LinkedFans, TheOrderOfSplitsThatShareNoFaceDoesNotMatter) {
  for (const auto& [name, mesh] : fan_shapes()) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      SCOPED_TRACE(name + ", seed " + std::to_string(seed));
      SeededRandom random(seed);
      constexpr std::size_t kRoots = 12;
      const LinkedFans base = fans_of(mesh, 3 * kRoots);
      const auto by_root = independent_splits(base, static_cast<VertexId>(mesh.positions.size()), kRoots, random);
      Image expected;
      for (int order = 0; order < 5; ++order) {
        LinkedFans fans = base;
        std::vector<std::size_t> next(by_root.size(), 0);
        for (const std::size_t r : random_turns(by_root, random)) {
          const Split& s = by_root[r][next[r]++];
          fans.split(s.root, s.added, s.first, s.last);
        }
        if (order == 0) expected = image_of(fans);
        ASSERT_TRUE(image_of(fans) == expected) << "order " << order;
        expect_linked(fans);
        // Nor does that of undoing them.
        for (const std::size_t r : random_turns(by_root, random)) {
          const Split& s = by_root[r][--next[r]];
          fans.merge(s.root, s.added, s.root_corner);
        }
        ASSERT_TRUE(image_of(fans) == image_of(base)) << "order " << order;
      }
    }
  }
}

TEST(LinkedFans, AFanStartsWhereItDidWhateverHappensAroundIt) {
  for (const auto& [name, mesh] : fan_shapes()) {
    SCOPED_TRACE(name);
    SeededRandom random(17);
    const auto base = static_cast<VertexId>(mesh.positions.size());
    LinkedFans fans = fans_of(mesh, 40);
    for (VertexId added = base; added < base + 40; ++added) {
      const Image before = image_of(fans);
      const Split s = random_split(fans, random.below(added), added, random);
      fans.split(s.root, s.added, s.first, s.last);
      for (VertexId v = 0; v < added; ++v) {
        if (v != s.root) {
          ASSERT_EQ(fans.corner(v), before.starts[v]) << "vertex " << v << ", split " << added - base;
        }
      }
    }
  }
}

// The fan of a closed or open centre 0 whose rim is 1..sides.
LinkedFans fan(std::uint32_t sides, bool closed) {
  TriangleMesh mesh;
  mesh.positions.resize(sides + 1);
  for (VertexId i = 1; i < sides; ++i) mesh.triangles.push_back({0, i, i + 1});
  if (closed) mesh.triangles.push_back({0, sides, 1});
  return fans_of(mesh, 1);
}

std::uint32_t position(const LinkedFans& fans, VertexId v, VertexId neighbour) {
  const Ring ring = fans.ring(v);
  return static_cast<std::uint32_t>(std::find(ring.begin(), ring.end(), neighbour) - ring.begin());
}

TEST(LinkedFans, ABoundaryHasTheOutsideOnceInItsRing) {
  const LinkedFans open = fan(4, false);
  EXPECT_EQ(as_cycle(open.ring(0)), (Ring{1, 2, 3, 4, kOutside}));
  EXPECT_EQ(as_cycle(open.ring(2)), (Ring{0, 1, kOutside, 3}));
  EXPECT_EQ(as_cycle(fan(4, true).ring(0)), (Ring{1, 2, 3, 4}));
}

TEST(LinkedFans, TheOutsideAsFirstWingInsertsOneFace) {
  LinkedFans fans = fan(4, false);
  fans.split(0, 5, position(fans, 0, kOutside), position(fans, 0, 2));
  EXPECT_EQ(fans.triangles().size(), 4U);  // three and one
  EXPECT_EQ(fans.ring(5), (Ring{0, kOutside, 1, 2}));
  EXPECT_EQ(fans.ring(0), (Ring{kOutside, 5, 2, 3, 4}));
  expect_linked(fans);
}

TEST(LinkedFans, TheOutsideAsLastWingInsertsOneFace) {
  LinkedFans fans = fan(4, false);
  fans.split(0, 5, position(fans, 0, 3), position(fans, 0, kOutside));
  EXPECT_EQ(fans.triangles().size(), 4U);
  EXPECT_EQ(fans.ring(5), (Ring{0, 3, 4, kOutside}));
  EXPECT_EQ(fans.ring(0), (Ring{3, 5, kOutside, 1, 2}));
  expect_linked(fans);
}

TEST(LinkedFans, TwoWingsMayGiveTheOpeningToTheNewVertex) {
  LinkedFans fans = fan(4, false);
  const LinkedFans before = fans;
  fans.split(0, 5, position(fans, 0, 3), position(fans, 0, 2));
  EXPECT_EQ(fans.ring(0), (Ring{3, 5, 2}));
  EXPECT_EQ(fans.ring(5), (Ring{0, 3, 4, kOutside, 1, 2}));
  expect_linked(fans);
  fans.merge(0, 5, before.corner(0));
  EXPECT_TRUE(image_of(fans) == image_of(before));
}

}  // namespace
}  // namespace fanstream
