#include "common/refine/cell_coder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "common/mesh/manifold_check.h"
#include "tests/support/exact_bytes.h"
#include "tests/support/seeded_random.h"
#include "tests/unit/common/fans/fan_shapes.h"

namespace fanstream {
namespace {

using testing::ExactBytes;
using testing::SeededRandom;

constexpr std::uint32_t kMostSplits = 200;
constexpr std::uint32_t kCoded = 4;  // generations that are coded
constexpr std::uint32_t kLast = 8;   // of the asset

PositionGrid grid() { return PositionGrid::fit({{0, 0, 0}, {1000, 1000, 1000}}, 10); }

// Everything exact, and coarser at coarse generations.
std::array<PlacePrecision, 2> precisions() {
  return {PlacePrecision(), PlacePrecision(std::vector<std::uint8_t>{3, 3, 2, 2, 1, 0}, grid())};
}

FanState state_of(const TriangleMesh& mesh, SeededRandom& random, const PlacePrecision& precision = {}) {
  BaseMesh base;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    base.places.emplace_back(random.between(300, 700), random.between(300, 700), random.between(300, 700));
  }
  base.triangles = mesh.triangles;
  return FanState::from_base(base, mesh.positions.size() + kMostSplits, precision);
}

// The source of a decoder, which notes what undoing needs.
struct DecodedSplits {
  std::vector<SplitUndo>& undo;

  void describe(SplitInProgress& /*split*/) const {}
  void made(const SplitUndo& made, VertexId /*added*/) const { undo.push_back(made); }
};

// As a head gives them, once next splits are known.
void show_base(FanState& state, VertexId vertices) {
  for (VertexId v = 0; v < vertices; ++v) {
    state.vertices[v].place = state.precision.shown(state.vertices[v].place, state.vertices[v].context);
  }
}

// Of all vertices: what their contexts say is known.
void expect_known_places(const FanState& state) {
  for (VertexId v = 0; v < state.vertices.size(); ++v) {
    const FanVertex& vertex = state.vertices[v];
    if (!state.fans.contains(v)) continue;
    EXPECT_EQ(vertex.place, state.precision.shown(vertex.place, vertex.context)) << "vertex " << v;
  }
}

// Every second vertex or so in the cell, all others in another.
CellVertices random_cell(FanState& state, VertexId vertices, SeededRandom& random) {
  CellVertices cell{7, {}, vertices, 0, kMostSplits};
  CompactList<VertexId> others;
  for (VertexId v = 0; v < vertices; ++v) (random.one_in(3) ? others : cell.initial).push_back(v);
  state.set_cell(7, cell.initial);
  state.set_cell(3, others);
  return cell;
}

// Chooses next splits that the format allows, and no more of them within the coded generations than there may be
// splits.
struct NextSplitChooser {
  SeededRandom& random;
  std::uint32_t left = kMostSplits;

  std::uint8_t choose(std::uint32_t first, std::uint32_t last, std::uint64_t taken) {
    const auto wanted = static_cast<std::uint8_t>(first + random.below(last - first + 1));
    if (random.one_in(5) || (taken >> wanted & 1U) != 0) return kNeverSplit;
    if (wanted <= kCoded && left == 0) return kNeverSplit;
    if (wanted <= kCoded) --left;
    return wanted;
  }
};

std::uint64_t bit_of(const FanState& state, VertexId v) {
  return v == kOutside || state.vertices[v].context.next == kNeverSplit
             ? 0
             : std::uint64_t{1} << state.vertices[v].context.next;
}

// The first splits of all vertices of a base; those of other cells come later than what is coded.
void choose_first_splits(FanState& state, VertexId vertices, NextSplitChooser& chooser) {
  for (VertexId v = 0; v < vertices; ++v) {
    std::uint64_t taken = 0;
    state.fans.for_each_neighbour(v, [&](VertexId w) { taken |= bit_of(state, w); });
    state.vertices[v].context.next = chooser.choose(state.cells[v] == 7 ? 1 : kCoded + 1, kLast, taken);
  }
}

// Splits roots at random, and says when both vertices are split next.
struct RandomSource {
  const FanState& state;
  SeededRandom& random;
  NextSplitChooser& chooser;
  std::uint32_t generation;
  std::vector<std::uint32_t> rounds;  // of the splits that were made, by root
  std::map<VertexId, std::uint32_t> made_of;

  void describe(SplitInProgress& s) const {
    const std::uint32_t size = s.ring.size();
    FanSplit& split = s.split;
    split.first = random.below(size);
    split.last = (split.first + 1 + random.below(size - 1)) % size;
    split.parent = static_cast<ParentPosition>(random.below(3));
    const std::int32_t reach = 9 >> state.precision.left_out(generation);  // points of the lattice
    split.displacement = {random.between(-reach, reach), random.between(-reach, reach), random.between(-reach, reach)};
    std::uint64_t root_taken = 0;
    std::uint64_t added_taken = 0;
    for (std::uint32_t i = split.last;; i = (i + 1) % size) {
      root_taken |= bit_of(state, s.ring.id(i));
      if (i == split.first) break;
    }
    for (std::uint32_t i = split.first;; i = (i + 1) % size) {
      added_taken |= bit_of(state, s.ring.id(i));
      if (i == split.last) break;
    }
    s.root_next = chooser.choose(generation, kLast, root_taken);
    if (s.root_next != kNeverSplit) added_taken |= std::uint64_t{1} << s.root_next;
    s.added_next = generation == kLast ? kNeverSplit : chooser.choose(generation + 1, kLast, added_taken);
    s.kept_low = low_bits(state.precision.lattice(generation), state.precision.known(generation, s.root_next));
    s.added_low = low_bits(state.precision.lattice(generation), state.precision.known(generation, s.added_next));
  }
  LowBits root_low_bits(VertexId root) const {
    const VertexContext& context = state.vertices[root].context;
    return low_bits(state.precision.known(context.touched, context.next), state.precision.lattice(generation));
  }
  LowBits low_bits(const PlaceLattice& from, const PlaceLattice& to) const {
    return random.below(1U << LatticeStep(from, to).bit_count);
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
      image.vertices.push_back({f.place.x, f.place.y, f.place.z, f.context.next, f.context.touched});
    }
  }
  return image;
}

// No two neighbours are split next in one generation.
void expect_no_neighbours_together(const FanState& state) {
  for (VertexId v = 0; v < state.vertices.size(); ++v) {
    state.fans.for_each_neighbour(v, [&](VertexId w) {
      const std::uint8_t next = state.vertices[v].context.next;
      EXPECT_TRUE(next == kNeverSplit || next != state.vertices[w].context.next) << "vertices " << v << " and " << w;
    });
  }
}

TEST(CellCoder, GenerationsComeBackAndCanBeUndone) {
  const SplitModel model;
  const PositionGrid points = grid();
  CellCoding coding(model, points, kLast);  // used for all, as a client does
  std::size_t splits = 0;
  for (const auto& [name, mesh] : testing::fan_shapes()) {
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      SCOPED_TRACE(name + ", seed " + std::to_string(seed));
      SeededRandom random(seed);
      NextSplitChooser chooser{random};
      FanState given = state_of(mesh, random, precisions()[seed % 2]);
      CellVertices given_cell = random_cell(given, static_cast<VertexId>(mesh.positions.size()), random);
      choose_first_splits(given, static_cast<VertexId>(mesh.positions.size()), chooser);
      show_base(given, static_cast<VertexId>(mesh.positions.size()));
      FanState found = given;
      CellVertices found_cell = given_cell;
      const Image base = image_of(given);
      RansEncoder encoder;
      for (std::uint32_t generation = 1; generation <= kCoded; ++generation) {
        ASSERT_EQ(find_roots(given, given_cell, generation, coding), kOutside);
        RandomSource source{given, random, chooser, generation, {}, {}};
        const Result<void> coded = code_generation(given, given_cell, generation, encoder, source, coding);
        ASSERT_TRUE(coded) << coded.error().message;
        EXPECT_TRUE(std::is_sorted(source.rounds.begin(), source.rounds.end()))
            << "the first split of all roots comes first";
        for (std::uint32_t i = 0; i < given_cell.count(); ++i) {
          ASSERT_GT(given.vertices[given_cell.at(i)].context.next, generation) << "all of the generation was made";
        }
        expect_no_neighbours_together(given);
        expect_known_places(given);
      }
      const ExactBytes bytes(encoder.finish());
      RansDecoder decoder(bytes.view());
      std::vector<SplitUndo> undo;
      std::vector<std::uint32_t> generation_of;
      for (std::uint32_t generation = 1; generation <= kCoded; ++generation) {
        ASSERT_EQ(find_roots(found, found_cell, generation, coding), kOutside);
        DecodedSplits source{undo};
        const Result<void> coded = code_generation(found, found_cell, generation, decoder, source, coding);
        ASSERT_TRUE(coded) << coded.error().message;
        generation_of.resize(undo.size(), generation);
      }
      ASSERT_TRUE(decoder.finished_cleanly());
      ASSERT_TRUE(image_of(found) == image_of(given));
      ASSERT_EQ(found_cell.made, given_cell.made);
      splits += undo.size();
      while (!undo.empty()) {
        const auto added = static_cast<VertexId>(mesh.positions.size() + undo.size() - 1);
        undo_split(found, generation_of[undo.size() - 1], undo.back(), added);
        undo.pop_back();
      }
      ASSERT_TRUE(image_of(found) == base) << "next splits included";
    }
  }
  EXPECT_GT(splits, 1000U);
}

TEST(CellCoder, RootsAreTheVerticesOfTheGenerationInTheCellsOrder) {
  const SplitModel model;
  const PositionGrid points = grid();
  CellCoding coding(model, points, kLast);
  SeededRandom random(4);
  FanState state = state_of(testing::make_torus(9, 7), random);
  CellVertices cell{7, std::vector<VertexId>{2, 5, 20, 40, 60}, 63, 0, kMostSplits};
  state.set_cell(7, cell.initial);
  for (const VertexId v : {2, 20, 60}) state.vertices[v].context.next = 3;
  state.vertices[5].context.next = 4;
  state.vertices[50].context.next = 3;  // of no cell
  ASSERT_EQ(find_roots(state, cell, 3, coding), kOutside);
  ASSERT_EQ(coding.root_count, 3U);
  EXPECT_EQ(coding.roots[0].vertex, 2U);
  EXPECT_EQ(coding.roots[1].vertex, 20U);
  EXPECT_EQ(coding.roots[2].vertex, 60U);
  ASSERT_EQ(find_roots(state, cell, 3, coding), kOutside);
  ASSERT_EQ(coding.root_count, 6U) << "behind those of others";
  EXPECT_EQ(coding.roots[3].vertex, 2U);
  coding.root_count = 0;
  ASSERT_EQ(find_roots(state, cell, 1, coding), kOutside);
  EXPECT_EQ(coding.root_count, 0U);
}

// Whatever the valence: rings of more than sixteen are not walked beforehand.
TEST(CellCoder, ARootWaitsForNeighboursThatAreStillToBeSplitCoarser) {
  const SplitModel model;
  const PositionGrid points = grid();
  CellCoding coding(model, points, kLast);
  for (const TriangleMesh& mesh : {testing::make_torus(9, 7), test::make_double_cone(90)}) {
    SeededRandom random(1);
    FanState state = state_of(mesh, random);
    VertexId root = 0;  // of the greatest valence
    for (VertexId v = 0; v < mesh.positions.size(); ++v) {
      if (state.fans.ring_size(v) > state.fans.ring_size(root)) root = v;
    }
    CellVertices cell{7, std::vector<VertexId>{root}, static_cast<VertexId>(mesh.positions.size()), 0, kMostSplits};
    state.set_cell(7, cell.initial);
    state.vertices[root].context.next = 5;
    const std::vector<VertexId> ring = state.fans.ring(root);
    for (const VertexId w : ring) {
      for (const std::uint8_t next : {std::uint8_t{4}, std::uint8_t{6}, kNeverSplit}) {
        state.vertices[w].context.next = next;
        EXPECT_EQ(find_roots(state, cell, 5, coding), next == 4 ? w : kOutside);
      }
      state.vertices[w].context.next = 3;
      EXPECT_EQ(find_roots(state, cell, 4, coding), kOutside) << "without roots nothing has to be waited for";
      state.vertices[w].context.next = kNeverSplit;
    }
  }
}

TEST(CellCoder, MoreSplitsThanTheCellTableSaysAreRefused) {
  const SplitModel model;
  const PositionGrid points = grid();
  CellCoding coding(model, points, kLast);
  SeededRandom random(1);
  FanState state = state_of(testing::make_torus(9, 7), random);
  CellVertices cell{7, std::vector<VertexId>{0, 2, 4}, 63, 0, 2};
  state.set_cell(7, cell.initial);
  for (const VertexId v : cell.initial) state.vertices[v].context.next = 1;
  const Image before = image_of(state);
  RansDecoder decoder;
  std::vector<SplitUndo> undo;
  DecodedSplits source{undo};
  ASSERT_EQ(find_roots(state, cell, 1, coding), kOutside);
  const Result<void> coded = code_generation(state, cell, 1, decoder, source, coding);
  ASSERT_FALSE(coded);
  EXPECT_EQ(coded.error().message, "cell 7: its vertices are split more often than the cell table allows");
  EXPECT_TRUE(image_of(state) == before);
}

std::vector<std::byte> noise(SeededRandom& random, std::size_t most) {
  std::vector<std::byte> bytes(random.below(most));
  for (std::byte& b : bytes) b = static_cast<std::byte>(random.below(256));
  return bytes;
}

// Two cells whose streams are noise, refined by the rule in any order: whatever comes out is a manifold without
// neighbours that are roots of one generation, and all of it can be taken back.
TEST(CellCoder, StreamsOfAnyBytesNeverSplitNeighboursInOneGeneration) {
  const SplitModel model;
  const PositionGrid points = grid();
  CellCoding coding(model, points, kLast);
  struct Made {
    SplitUndo undo;
    std::uint32_t generation;
    VertexId added;
  };
  std::size_t splits = 0;
  for (const auto& [name, mesh] : testing::fan_shapes()) {
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
      SCOPED_TRACE(name + ", seed " + std::to_string(seed));
      SeededRandom random(seed);
      const auto vertices = static_cast<VertexId>(mesh.positions.size());
      FanState state = state_of(mesh, random, precisions()[seed % 2]);
      std::array<CellVertices, 2> cells{random_cell(state, vertices, random), CellVertices{}};
      cells[0].most_new = kMostSplits / 2;
      cells[1] = {3, {}, vertices + kMostSplits / 2, 0, kMostSplits / 2};
      for (VertexId v = 0; v < vertices; ++v) {
        if (state.cells[v] == 3) cells[1].initial.push_back(v);
      }
      const ExactBytes base_bytes(noise(random, 200));
      RansDecoder base_decoder(base_bytes.view());
      std::vector<std::uint8_t> next(vertices);
      code_base_splits(base_decoder, model, state.fans, kLast, std::span(next));
      state.set_next_splits(next);
      show_base(state, vertices);
      const Image base = image_of(state);
      const std::array<ExactBytes, 2> bytes{ExactBytes(noise(random, 900)), ExactBytes(noise(random, 900))};
      std::array<RansDecoder, 2> decoders{RansDecoder(bytes[0].view()), RansDecoder(bytes[1].view())};
      std::array<std::uint32_t, 2> done{0, 0};
      std::vector<Made> made;
      bool failed = false;
      while (!failed) {
        const std::size_t first = random.below(2);
        std::size_t c = first;
        bool ready = false;
        for (const std::size_t tried : {first, 1 - first}) {
          c = tried;
          coding.root_count = 0;
          ready = done[c] < kLast && find_roots(state, cells[c], done[c] + 1, coding) == kOutside;
          if (ready) break;
        }
        if (!ready) break;
        ++done[c];
        std::set<VertexId> roots;
        for (std::size_t i = 0; i < coding.root_count; ++i) roots.insert(coding.roots[i].vertex);
        for (const VertexId v : roots) {
          state.fans.for_each_neighbour(v, [&](VertexId w) { ASSERT_FALSE(roots.contains(w)) << v << " and " << w; });
        }
        const VertexId before = cells[c].made;
        std::vector<SplitUndo> undo;
        DecodedSplits source{undo};
        failed = !code_generation(state, cells[c], done[c], decoders[c], source, coding);
        for (std::size_t i = 0; i < undo.size(); ++i) {
          made.push_back({undo[i], done[c], static_cast<VertexId>(cells[c].first_new + before + i)});
        }
        std::string why;
        ASSERT_TRUE(is_oriented_manifold(testing::compact_faces(state.fans), &why)) << why;
        expect_no_neighbours_together(state);
        expect_known_places(state);
        if (HasFailure()) return;
      }
      EXPECT_TRUE(failed || (done[0] == kLast && done[1] == kLast)) << "some cell can always go on";
      splits += made.size();
      for (; !made.empty(); made.pop_back()) {
        undo_split(state, made.back().generation, made.back().undo, made.back().added);
      }
      ASSERT_TRUE(image_of(state) == base);
    }
  }
  EXPECT_GT(splits, 5000U);
}

}  // namespace
}  // namespace fanstream
