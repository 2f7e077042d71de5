#include "server/build/coded_history.h"

#include <gtest/gtest.h>

#include "tests/support/asset_helpers.h"

namespace fanstream {
namespace {

using testing::model_shapes;

// A history on the grid that is undone split by split, in the order in which it is coded.
class Replay {
 public:
  explicit Replay(const TriangleMesh& mesh, const SimplifyOptions& options)
      : history_(simplify(mesh, options)),
        coded_(history_, places_of(mesh), PositionGrid::fit(mesh.positions, 12)),
        base_(coded_.base(numbers_)),
        source_(coded_, numbers_, mesh.positions.size()),
        number_(mesh.positions.size(), kOutside),
        state_(FanState::from_base(base_, mesh.positions.size())),
        next_vertex_(static_cast<VertexId>(base_.places.size())) {
    for (VertexId v = 0; v < numbers_.size(); ++v) number_[numbers_[v]] = v;
    state_.set_next_splits(source_.next_splits_of_base());
  }

  std::uint32_t generation_count() const { return coded_.generation_count(); }
  const FanState& state() const { return state_; }

  // The roots of a generation, by coded number.
  std::vector<VertexId> roots(std::uint32_t generation) const {
    std::vector<VertexId> roots;
    for (std::uint32_t m = coded_.generation_begin(generation); m < coded_.generation_end(generation); ++m) {
      roots.push_back(number_[history_.merges[m].root]);
    }
    std::sort(roots.begin(), roots.end());
    roots.erase(std::unique(roots.begin(), roots.end()), roots.end());
    return roots;
  }

  // Undoes a generation; what the source says of next splits is compared with a search through the history.
  void split_generation(std::uint32_t generation) {
    for (std::uint32_t m = coded_.generation_end(generation); m-- > coded_.generation_begin(generation);) {
      const MergeRecord& merge = history_.merges[m];
      const VertexId root = number_[merge.root];
      SplitInProgress s;
      s.ring.load(state_.fans, root);
      s.split.root = root;
      source_.describe(s);
      ASSERT_EQ(s.root_next, next_split(merge.root, m)) << "merge " << m;
      ASSERT_EQ(s.added_next, next_split(merge.removed, m)) << "merge " << m;
      const LinkedFans::Arc arc = s.ring.arc(s.split.first, s.split.last);
      const SplitLanes places = places_after_split(state_.vertices[root].place4(), s.split.parent,
                                                   int4(s.split.displacement), generation, GridPoint(0));
      const SplitUndo undo{root, state_.fans.corner(root), state_.vertices[root].context, s.split.parent};
      apply_split(state_, 0, generation, root, arc, places, {s.root_next, s.added_next}, next_vertex_);
      number_[merge.removed] = next_vertex_;
      source_.made(undo, next_vertex_++);
    }
  }

 private:
  static std::vector<GridPoint> places_of(const TriangleMesh& mesh) {
    const PositionGrid grid = PositionGrid::fit(mesh.positions, 12);
    std::vector<GridPoint> places;
    for (const glm::dvec3& p : mesh.positions) places.push_back(grid.encode(p));
    return places;
  }

  // The generation of the last merge before m, which is the first to be undone after it, whose root a vertex is.
  std::uint8_t next_split(VertexId v, std::uint32_t m) const {
    while (m-- > 0) {
      if (history_.merges[m].root != v) continue;
      std::uint32_t generation = 1;
      while (m < coded_.generation_begin(generation) || m >= coded_.generation_end(generation)) ++generation;
      return static_cast<std::uint8_t>(generation);
    }
    return kNeverSplit;
  }

  MergeHistory history_;
  CodedHistory coded_;
  std::vector<VertexId> numbers_;
  BaseMesh base_;
  HistorySource source_;
  std::vector<VertexId> number_;  // by the model's vertex
  FanState state_;
  VertexId next_vertex_;
};

std::vector<VertexId> to_be_split(const FanState& state, std::uint32_t generation) {
  std::vector<VertexId> roots;
  for (VertexId v = 0; v < state.vertices.size(); ++v) {
    if (state.fans.contains(v) && state.vertices[v].context.next == generation) roots.push_back(v);
  }
  return roots;
}

TEST(CodedHistory, EveryVertexIsToldWhenItIsSplitNext) {
  for (const auto& [name, mesh] : model_shapes()) {
    SCOPED_TRACE(name);
    SimplifyOptions options;
    options.base_vertices = 40;
    Replay replay(mesh, options);
    ASSERT_LE(replay.generation_count(), kMostGenerations);
    for (std::uint32_t g = 1; g <= replay.generation_count(); ++g) {
      ASSERT_EQ(to_be_split(replay.state(), g), replay.roots(g)) << "generation " << g;
      replay.split_generation(g);
      if (HasFatalFailure()) return;
      ASSERT_TRUE(to_be_split(replay.state(), g).empty()) << "generation " << g;
    }
    for (const FanVertex& v : replay.state().vertices) ASSERT_EQ(v.context.next, kNeverSplit);
  }
}

// What the coding of next splits rests on: the format has no word for anything else.
TEST(CodedHistory, NeighboursAreNeverSplitNextInOneGeneration) {
  for (const auto& [name, mesh] : model_shapes()) {
    SCOPED_TRACE(name);
    SimplifyOptions options;
    options.base_vertices = 40;
    Replay replay(mesh, options);
    for (std::uint32_t g = 0; g <= replay.generation_count(); ++g) {
      if (g > 0) replay.split_generation(g);
      const FanState& state = replay.state();
      for (VertexId v = 0; v < state.vertices.size(); ++v) {
        const std::uint8_t next = state.vertices[v].context.next;
        if (!state.fans.contains(v) || next == kNeverSplit) continue;
        ASSERT_GT(next, g);
        state.fans.for_each_neighbour(v, [&](VertexId w) {
          ASSERT_NE(next, state.vertices[w].context.next) << v << " and " << w << " after generation " << g;
        });
      }
      if (HasFatalFailure()) return;
    }
  }
}

}  // namespace
}  // namespace fanstream
