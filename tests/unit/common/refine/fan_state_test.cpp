#include "common/refine/fan_state.h"

#include <gtest/gtest.h>

#include <array>
#include <set>

#include "common/coding/ring_geometry.h"
#include "tests/support/seeded_random.h"
#include "tests/unit/common/fans/fan_shapes.h"

namespace fanstream {
namespace {

using testing::fan_shapes;
using testing::SeededRandom;

constexpr std::uint32_t kSplits = 36;

// The mesh as a base, its vertices in cells 0..2 at random.
FanState state_of(const TriangleMesh& mesh, SeededRandom& random) {
  BaseMesh base;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    base.places.emplace_back(random.between(0, 99), random.between(0, 99), random.between(0, 99));
  }
  base.triangles = mesh.triangles;
  FanState state = FanState::from_base(base, mesh.positions.size() + kSplits);
  std::array<std::vector<VertexId>, 3> cells;
  for (VertexId v = 0; v < mesh.positions.size(); ++v) cells[random.below(3)].push_back(v);
  for (std::uint32_t c = 0; c < 3; ++c) state.set_cell(c, cells[c]);
  return state;
}

// All of a state but what lies where no vertex is.
struct Image {
  std::vector<std::vector<VertexId>> rings;
  std::vector<std::array<int, 6>> vertices;
  bool operator==(const Image&) const = default;
};

Image image_of(const FanState& state) {
  Image image;
  for (VertexId v = 0; v < state.vertices.size(); ++v) {
    image.rings.push_back(state.fans.ring(v));
    const FanVertex& vertex = state.vertices[v];
    if (!state.fans.contains(v)) continue;
    image.vertices.push_back({vertex.place.x, vertex.place.y, vertex.place.z, vertex.context.next,
                              vertex.context.touched, static_cast<int>(state.cells[v])});
  }
  return image;
}

struct Applied {
  FanSplit split;
  NextSplits next;
  VertexId added;
  std::uint32_t generation;
  SplitUndo undo;
};

FanSplit random_split(const FanState& state, VertexId root, SeededRandom& random) {
  const std::uint32_t size = state.fans.ring_size(root);
  FanSplit split{root, random.below(size), 0, static_cast<ParentPosition>(random.below(4)), {}};
  split.last = (split.first + 1 + random.below(size - 1)) % size;
  split.displacement = {random.between(-9, 9), random.between(-9, 9), random.between(-9, 9)};
  const int most = random.one_in(2) ? 9 : kMostShift;
  split.shift = {random.between(-most, most), random.between(-most, most), random.between(-most, most)};
  return split;
}

NextSplits random_next(SeededRandom& random) {
  const auto one = [&] { return random.one_in(3) ? kNeverSplit : static_cast<std::uint8_t>(1 + random.below(64)); };
  return {one(), one()};
}

Applied apply(FanState& state, const FanSplit& split, NextSplits next, VertexId added, std::uint32_t generation) {
  const VertexId root = split.root;
  const Applied applied{split,
                        next,
                        added,
                        generation,
                        {root, state.fans.corner(root), state.vertices[root].context, split.parent, split.shift}};
  RingGeometry ring;
  ring.load(state.fans, root);
  const LinkedFans::Arc arc = ring.arc(split.first, split.last);
  const SplitLanes places = places_after_split(state.vertices[root].place4(), split.parent, int4(split.displacement),
                                               generation, split.shift);
  apply_split(state, state.cells[root], generation, root, arc, places, next, added);
  return applied;
}

void undo(FanState& state, const Applied& a) { undo_split(state, a.generation, a.undo, a.added); }

TEST(FanState, TheBaseHasNoVertexSplitYet) {
  SeededRandom random(1);
  FanState state = state_of(testing::make_torus(9, 7), random);
  std::vector<std::uint8_t> next(63);
  for (VertexId v = 0; v < 63; ++v) {
    EXPECT_EQ(state.vertices[v].context.next, kNeverSplit);
    EXPECT_EQ(state.vertices[v].context.touched, 0);
    EXPECT_EQ(state.places()[v], state.vertices[v].place);
    next[v] = random_next(random).root;
  }
  state.set_next_splits(next);
  for (VertexId v = 0; v < 63; ++v) EXPECT_EQ(state.vertices[v].context.next, next[v]);
}

TEST(FanState, UndoingGivesBackTheStateBefore) {
  for (const auto& [name, mesh] : fan_shapes()) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      SCOPED_TRACE(name + ", seed " + std::to_string(seed));
      SeededRandom random(seed);
      FanState state = state_of(mesh, random);
      const auto base = static_cast<VertexId>(mesh.positions.size());
      std::vector<std::pair<Applied, Image>> made;
      for (VertexId added = base; added < base + kSplits; ++added) {
        const FanSplit split = random_split(state, random.below(added), random);
        Image before = image_of(state);
        const NextSplits next = random_next(random);
        const std::uint32_t generation = 1 + random.below(kMostGenerations);
        made.emplace_back(apply(state, split, next, added, generation), std::move(before));
        const FanVertex& root = state.vertices[split.root];
        ASSERT_EQ(state.vertices[added].place - root.place, split.displacement);
        ASSERT_EQ(root.context.next, next.root);
        ASSERT_EQ(root.context.touched, generation);
        ASSERT_EQ(state.vertices[added].context.next, next.added);
        ASSERT_EQ(state.vertices[added].context.touched, generation);
        ASSERT_EQ(state.cells[added], state.cells[split.root]);
      }
      for (; !made.empty(); made.pop_back()) {
        undo(state, made.back().first);
        ASSERT_TRUE(image_of(state) == made.back().second) << "split " << made.size();
      }
    }
  }
}

// Patches that share no face: rings, where they start, places and contexts do not depend on which is split first.
TEST(FanState, TheOrderOfSplitsThatShareNoFaceDoesNotMatter) {
  for (const auto& [name, mesh] : fan_shapes()) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      SCOPED_TRACE(name + ", seed " + std::to_string(seed));
      SeededRandom random(seed);
      const FanState base = state_of(mesh, random);
      std::vector<VertexId> candidates;
      for (VertexId v = 0; v < mesh.positions.size(); ++v) candidates.push_back(v);
      random.shuffle(candidates);
      std::set<VertexId> closed;
      struct Planned {
        FanSplit split;
        NextSplits next;
        VertexId added;
      };
      std::vector<Planned> splits;
      for (const VertexId v : candidates) {
        if (closed.contains(v) || splits.size() == kSplits) continue;
        base.fans.for_each_neighbour(v, [&](VertexId w) { closed.insert(w); });
        splits.push_back({random_split(base, v, random), random_next(random),
                          static_cast<VertexId>(mesh.positions.size() + splits.size())});
      }
      Image expected;
      for (int order = 0; order < 4; ++order) {
        FanState state = base;
        std::vector<Applied> made;
        for (const Planned& p : splits) made.push_back(apply(state, p.split, p.next, p.added, 5));
        if (order == 0) expected = image_of(state);
        ASSERT_TRUE(image_of(state) == expected) << "order " << order;
        random.shuffle(made);
        for (const Applied& a : made) undo(state, a);
        ASSERT_TRUE(image_of(state) == image_of(base)) << "order " << order;
        random.shuffle(splits);
      }
    }
  }
}

// So what is known of a vertex does not depend on how far the cells around it have come.
TEST(FanState, ASplitChangesItsRootAndItsNewVertexAlone) {
  for (const auto& [name, mesh] : fan_shapes()) {
    SCOPED_TRACE(name);
    SeededRandom random(3);
    FanState state = state_of(mesh, random);
    const auto base = static_cast<VertexId>(mesh.positions.size());
    for (VertexId added = base; added < base + kSplits; ++added) {
      const FanSplit split = random_split(state, random.below(added), random);
      const PagedArray<FanVertex> before = state.vertices;
      const PagedArray<std::uint32_t> cells = state.cells;
      apply(state, split, random_next(random), added, 2);
      for (VertexId v = 0; v < added; ++v) {
        ASSERT_EQ(state.cells[v], cells[v]);
        if (v == split.root) continue;
        ASSERT_EQ(state.vertices[v].context.next, before[v].context.next);
        ASSERT_EQ(state.vertices[v].context.touched, before[v].context.touched);
        ASSERT_EQ(state.vertices[v].place, before[v].place);
      }
    }
  }
}

}  // namespace
}  // namespace fanstream
