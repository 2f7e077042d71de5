#include "common/refine/cell_coder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "tests/support/exact_bytes.h"
#include "tests/support/seeded_random.h"
#include "tests/unit/common/fans/fan_shapes.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

constexpr std::uint32_t kMostSplits = 200;

PositionGrid grid() { return PositionGrid::fit({{0, 0, 0}, {1000, 1000, 1000}}, 10); }

FanState state_of(const TriangleMesh& mesh, SeededRandom& random) {
  BaseMesh base;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    base.places.emplace_back(random.between(300, 700), random.between(300, 700), random.between(300, 700));
  }
  base.triangles = mesh.triangles;
  return FanState::from_base(base, mesh.positions.size() + kMostSplits);
}

// Every second vertex or so in the cell, all others in another.
CellVertices random_cell(FanState& state, VertexId vertices, SeededRandom& random) {
  CellVertices cell{7, {}, vertices, 0, kMostSplits};
  std::vector<VertexId> others;
  for (VertexId v = 0; v < vertices; ++v) (random.one_in(3) ? others : cell.initial).push_back(v);
  state.set_cell(7, cell.initial);
  state.set_cell(3, others);
  return cell;
}

// Splits vertices at random, up to three times each, none beside another.
struct RandomSource {
  const FanState& state;
  SeededRandom& random;
  mutable std::set<VertexId> closed;
  mutable std::uint32_t left = kMostSplits;
  std::vector<std::uint32_t> rounds;  // of the splits that were made, by root
  std::map<VertexId, std::uint32_t> made_of;

  std::uint32_t split_count(VertexId v) const {
    if (closed.contains(v) || left < 3 || random.one_in(3)) return 0;
    state.fans.for_each_neighbour(v, [&](VertexId w) { closed.insert(w); });
    const std::uint32_t count = 1 + random.below(3);
    left -= count;
    return count;
  }
  FanSplit split(const RingGeometry& ring, VertexId root) const {
    FanSplit split{root, random.below(ring.size()), 0, static_cast<ParentPosition>(random.below(3)), {}};
    split.last = (split.first + 1 + random.below(ring.size() - 1)) % ring.size();
    split.displacement = {random.between(-9, 9), random.between(-9, 9), random.between(-9, 9)};
    return split;
  }
  void made(const SplitUndo& undo, VertexId /*added*/) { rounds.push_back(made_of[undo.root]++); }
};

struct Image {
  std::vector<std::vector<VertexId>> rings;
  std::vector<std::array<int, 5>> vertices;
  bool operator==(const Image&) const = default;
};

Image image_of(const FanState& state) {
  Image image;
  for (VertexId v = 0; v < state.vertices.size(); ++v) {
    image.rings.push_back(state.fans.ring(v));
    const FanVertex& f = state.vertices[v];
    if (state.fans.contains(v)) {
      image.vertices.push_back({f.place.x, f.place.y, f.place.z, f.context.valence, f.context.touched});
    }
  }
  return image;
}

TEST(CellCoder, GenerationsComeBackAndCanBeUndone) {
  const SplitModel model;
  const PositionGrid points = grid();
  CellCoding coding(model, points);  // used for all, as a client does
  for (const auto& [name, mesh] : testing::fan_shapes()) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      SCOPED_TRACE(name + ", seed " + std::to_string(seed));
      SeededRandom random(seed);
      FanState given = state_of(mesh, random);
      CellVertices given_cell = random_cell(given, static_cast<VertexId>(mesh.positions.size()), random);
      FanState found = given;
      CellVertices found_cell = given_cell;
      const Image base = image_of(given);
      RansEncoder encoder;
      std::uint32_t left = kMostSplits;
      for (std::uint32_t generation = 1; generation <= 4; ++generation) {
        RandomSource source{given, random, {}, left, {}, {}};
        const Result<void> coded = code_generation(given, given_cell, generation, encoder, source, coding);
        ASSERT_TRUE(coded) << coded.error().message;
        EXPECT_TRUE(std::is_sorted(source.rounds.begin(), source.rounds.end()))
            << "the first split of all roots comes first";
        left = source.left;
      }
      const testing::ExactBytes bytes(encoder.finish());
      RansDecoder decoder(bytes.view());
      std::vector<SplitUndo> undo;
      std::vector<std::uint32_t> generation_of;
      for (std::uint32_t generation = 1; generation <= 4; ++generation) {
        DecodedSplits source{undo};
        const Result<void> coded = code_generation(found, found_cell, generation, decoder, source, coding);
        ASSERT_TRUE(coded) << coded.error().message;
        generation_of.resize(undo.size(), generation);
      }
      ASSERT_TRUE(decoder.finished_cleanly());
      ASSERT_TRUE(image_of(found) == image_of(given));
      ASSERT_EQ(found_cell.made, given_cell.made);
      while (!undo.empty()) {
        const auto added = static_cast<VertexId>(mesh.positions.size() + undo.size() - 1);
        undo_split(found, 7, generation_of[undo.size() - 1], undo.back(), added);
        undo.pop_back();
      }
      ASSERT_TRUE(image_of(found) == base);
    }
  }
}

// Damaged data may say so: roots of a group are coded before it is known what they close.
TEST(CellCoder, NeighboursThatAreBothSplitAreRefused) {
  struct EveryVertex {
    std::uint32_t split_count(VertexId /*v*/) const { return 1; }
    FanSplit split(const RingGeometry& /*ring*/, VertexId root) const { return {root, 0, 1, ParentPosition::kept, {}}; }
    void made(const SplitUndo& /*undo*/, VertexId /*added*/) const { ADD_FAILURE() << "a split was made"; }
  };
  const SplitModel model;
  const PositionGrid points = grid();
  for (const TriangleMesh& mesh :
       {testing::make_tetrahedron(), testing::make_torus(9, 7), test::make_double_cone(90)}) {
    CellCoding coding(model, points);
    SeededRandom random(1);
    FanState state = state_of(mesh, random);
    CellVertices cell{7, {}, static_cast<VertexId>(mesh.positions.size()), 0, kMostSplits};
    for (VertexId v = 0; v < mesh.positions.size(); ++v) cell.initial.push_back(v);
    state.set_cell(7, cell.initial);
    const Image before = image_of(state);
    RansEncoder encoder;
    EveryVertex source;
    const Result<void> coded = code_generation(state, cell, 1, encoder, source, coding);
    ASSERT_FALSE(coded);
    EXPECT_EQ(coded.error().message, "cell 7: two neighbours are split in one generation");
    EXPECT_TRUE(image_of(state) == before);
  }
}

// So that splits of one generation may be undone in any order, whatever the data.
TEST(CellCoder, ANeighbourThatTheCellNextDoorHasSplitInTheGenerationIsRefused) {
  struct EveryVertex {
    std::uint32_t split_count(VertexId /*v*/) const { return 1; }
    FanSplit split(const RingGeometry& /*ring*/, VertexId root) const { return {root, 0, 2, ParentPosition::kept, {}}; }
    void made(const SplitUndo& /*undo*/, VertexId /*added*/) const {}
  };
  constexpr std::uint32_t kGeneration = 5;
  const SplitModel model;
  const PositionGrid points = grid();
  const TriangleMesh mesh = testing::make_torus(9, 7);
  SeededRandom random(2);
  const FanState given = state_of(mesh, random);
  std::vector<VertexId> near = given.fans.ring(0);
  for (VertexId touched = 1; touched < mesh.positions.size(); ++touched) {
    for (const std::uint32_t generation : {kGeneration - 1, kGeneration, kGeneration + 1}) {
      FanState state = given;
      CellVertices cell{7, {0}, static_cast<VertexId>(mesh.positions.size()), 0, kMostSplits};
      state.set_cell(7, cell.initial);
      state.vertices[touched].context.touched = static_cast<std::uint8_t>(generation);
      CellCoding coding(model, points);
      RansEncoder encoder;
      EveryVertex source;
      const bool beside = std::find(near.begin(), near.end(), touched) != near.end();
      const Result<void> coded = code_generation(state, cell, kGeneration, encoder, source, coding);
      ASSERT_EQ(coded.has_value(), !beside || generation != kGeneration) << "vertex " << touched;
      ASSERT_EQ(cell.made, coded ? 1U : 0U);
    }
  }
}

}  // namespace
}  // namespace fanstream
