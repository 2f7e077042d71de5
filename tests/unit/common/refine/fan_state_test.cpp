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
  std::vector<std::array<int, 7>> vertices;
  bool operator==(const Image&) const = default;
};

Image image_of(const FanState& state) {
  Image image;
  for (VertexId v = 0; v < state.vertices.size(); ++v) {
    image.rings.push_back(state.fans.ring(v));
    const FanVertex& vertex = state.vertices[v];
    if (!state.fans.contains(v)) continue;
    image.vertices.push_back({vertex.place.x, vertex.place.y, vertex.place.z, vertex.context.valence,
                              vertex.context.touched, static_cast<int>(state.cells[v].cell),
                              static_cast<int>(state.cells[v].index)});
  }
  return image;
}

struct Applied {
  FanSplit split;
  VertexId added;
  std::uint32_t generation;
  SplitUndo undo;
};

FanSplit random_split(const FanState& state, VertexId root, SeededRandom& random) {
  const std::uint32_t size = state.fans.ring_size(root);
  FanSplit split{root, random.below(size), 0, static_cast<ParentPosition>(random.below(3)), {}};
  split.last = (split.first + 1 + random.below(size - 1)) % size;
  split.displacement = {random.between(-9, 9), random.between(-9, 9), random.between(-9, 9)};
  return split;
}

Applied apply(FanState& state, const FanSplit& split, VertexId added, std::uint32_t generation) {
  const VertexId root = split.root;
  const Applied applied{
      split, added, generation, {root, state.fans.corner(root), state.vertices[root].context, split.parent}};
  RingGeometry ring;
  ring.load(state.fans, root);
  const LinkedFans::Arc arc{ring.corner_before(split.first), ring.corner(split.first), ring.corner_before(split.last),
                            ring.corner(split.last)};
  const SplitPlaces places =
      places_after_split(state.vertices[root].place, split.parent, split.displacement, generation);
  apply_split(state, {state.cells[root].cell, added}, generation, split, arc, places, added);
  keep_undo(state, applied.undo, added);
  return applied;
}

void undo(FanState& state, const Applied& a) {
  undo_split(state, state.cells[a.undo.root].cell, a.generation, kept_undo(state, a.added), a.added);
}

TEST(FanState, TheBaseHasNoVertexSplitYet) {
  SeededRandom random(1);
  const FanState state = state_of(testing::make_torus(9, 7), random);
  for (VertexId v = 0; v < 63; ++v) {
    EXPECT_EQ(state.vertices[v].context.valence, 6);
    EXPECT_EQ(state.vertices[v].context.touched, 0);
    EXPECT_EQ(state.places()[v], state.vertices[v].place);
  }
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
        made.emplace_back(apply(state, split, added, 1 + random.below(250)), std::move(before));
        const FanVertex& root = state.vertices[split.root];
        ASSERT_EQ(state.vertices[added].place - root.place, split.displacement);
        ASSERT_EQ(root.context.valence, static_cast<std::uint8_t>(state.fans.ring_size(split.root)));
        ASSERT_EQ(state.cells[added].cell, state.cells[split.root].cell);
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
      std::vector<std::pair<FanSplit, VertexId>> splits;
      for (const VertexId v : candidates) {
        if (closed.contains(v) || splits.size() == kSplits) continue;
        base.fans.for_each_neighbour(v, [&](VertexId w) { closed.insert(w); });
        splits.emplace_back(random_split(base, v, random),
                            static_cast<VertexId>(mesh.positions.size() + splits.size()));
      }
      Image expected;
      for (int order = 0; order < 4; ++order) {
        FanState state = base;
        std::vector<Applied> made;
        for (const auto& [split, added] : splits) made.push_back(apply(state, split, added, 5));
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

TEST(FanState, OnlyWingsOfTheSameCellCountASplit) {
  SeededRandom random(3);
  const TriangleMesh mesh = testing::make_torus(9, 7);
  FanState state = state_of(mesh, random);
  for (VertexId added = 63; added < 63 + kSplits; ++added) {
    const FanSplit split = random_split(state, random.below(added), random);
    const std::vector<VertexId> ring = state.fans.ring(split.root);
    const PagedArray<FanVertex> before = state.vertices;
    apply(state, split, added, 2);
    for (VertexId v = 0; v < added; ++v) {
      if (v == split.root) continue;
      const bool wing = v == ring[split.first] || v == ring[split.last];
      const bool counts = wing && state.cells[v].cell == state.cells[split.root].cell;
      ASSERT_EQ(state.vertices[v].context.valence, before[v].context.valence + (counts ? 1 : 0)) << "vertex " << v;
      ASSERT_EQ(state.vertices[v].context.touched, before[v].context.touched);
      ASSERT_EQ(state.vertices[v].place, before[v].place);
    }
  }
}

}  // namespace
}  // namespace fanstream
