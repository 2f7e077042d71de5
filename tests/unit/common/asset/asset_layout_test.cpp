#include "common/asset/asset_layout.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>

#include "common/coding/fan_vertex.h"
#include "common/fans/linked_fans.h"
#include "tests/support/exact_bytes.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::ExactBytes;
using testing::SeededRandom;

TEST(ErrorCode, StandsForABoundLessThanAnEighthOfAnOctaveAbove) {
  const double step = 0.37;
  for (double error = 0.07 * step; error < 1e6; error *= 1.013) {
    const double bound = error_from_code(code_of_error(error, step), step);
    ASSERT_GE(bound, error * (1.0 - 1e-12));
    ASSERT_LE(bound, error * std::exp2(0.125) * (1.0 + 1e-12));
  }
}

TEST(ErrorCode, EveryCodeComesBack) {
  for (int code = 0; code < 256; ++code) {
    const double bound = error_from_code(static_cast<std::uint8_t>(code), 2.0);
    EXPECT_EQ(code_of_error(bound * (1.0 - 1e-9), 2.0), code);
    EXPECT_EQ(bound == 0.0, code == 0);
  }
  EXPECT_EQ(code_of_error(1e-9, 1.0), 1);  // what is small is not nothing
  EXPECT_EQ(code_of_error(1e300, 1.0), 255);
  EXPECT_EQ(code_of_error(std::nan(""), 1.0), 0);
}

// A head without the parts that the index does not look at, and a table of any shape that it allows.
struct RandomTable {
  AssetHead head;
  AssetIndex index;
  AssetPreamble preamble;

  explicit RandomTable(SeededRandom& random) {
    const TriangleMesh mesh = testing::make_torus(9, 7);
    head.base.places.resize(mesh.positions.size());
    head.base.triangles = mesh.triangles;
    std::uint32_t generation = 0;
    for (std::uint32_t layer = 1 + random.below(9); layer > 0; --layer) {
      generation += 1 + random.below(7);
      head.layer_ends.push_back(static_cast<std::uint8_t>(generation));
    }
    for (std::uint32_t layer = 0; layer < head.layer_ends.size();) {
      layer = std::min<std::uint32_t>(layer + 1 + random.below(4), static_cast<std::uint32_t>(head.layer_ends.size()));
      head.slab_ends.push_back(static_cast<std::uint8_t>(layer));
    }
    head.root_cell_count = 1 + random.below(20);
    head.vertex_count = static_cast<std::uint32_t>(mesh.positions.size());
    choose_base_splits(random);
    add_cells(random);
    place_segments();
  }

  void choose_base_splits(SeededRandom& random) {
    const LinkedFans fans(head.base.places.size(), head.base.triangles);
    index.base_next_splits.assign(head.base.places.size(), kNeverSplit);
    for (VertexId v = 0; v < index.base_next_splits.size(); ++v) {
      const auto wanted = static_cast<std::uint8_t>(1 + random.below(head.generation_count()));
      bool taken = random.one_in(5);
      fans.for_each_neighbour(v, [&](VertexId w) { taken = taken || index.base_next_splits[w] == wanted; });
      if (!taken) index.base_next_splits[v] = wanted;
    }
  }

  void add_cells(SeededRandom& random) {
    std::vector<std::uint32_t> parents(head.root_cell_count, 0xFFFFFFFFU);
    for (std::uint32_t slab = 0; slab < head.slab_ends.size(); ++slab) {
      std::vector<std::uint32_t> of_next;
      auto child = static_cast<std::uint32_t>(index.cells.size() + parents.size());
      for (const std::uint32_t parent : parents) {
        CellEntry cell;
        cell.parent = parent;
        cell.slab = slab;
        cell.first_child = child;
        const bool parent_of_some = slab + 1 < head.slab_ends.size();
        cell.child_count = parent_of_some ? random.below(4) + (of_next.empty() ? 1 : 0) : 0;
        child += cell.child_count;
        of_next.insert(of_next.end(), cell.child_count, static_cast<std::uint32_t>(index.cells.size()));
        cell.split_count = random.one_in(5) ? 0 : random.below(random.one_in(9) ? 5000 : 90);
        if (cell.split_count != 0 && !random.one_in(3)) {  // without splits there is nothing to look anywhere
          cell.cone.width = static_cast<std::uint8_t>(1 + random.below(CodedCone::kWidest));
          cell.cone.u = static_cast<std::uint8_t>(random.below(CodedCone::kPlaces));
          cell.cone.v = static_cast<std::uint8_t>(random.below(CodedCone::kPlaces));
        }
        cell.first_vertex = head.vertex_count;
        head.vertex_count += cell.split_count;
        cell.first_segment = static_cast<std::uint32_t>(index.segments.size());
        cell.segment_count = head.slab_ends[slab] - head.layer_begin(slab);
        for (std::uint32_t s = 0; s < cell.segment_count; ++s) {
          SegmentEntry segment;
          if (cell.split_count != 0) segment.size_bytes = 2 * random.below(1 + 3 * cell.split_count);
          segment.error_code = static_cast<std::uint8_t>(random.below(256));
          index.segments.push_back(segment);
        }
        index.cells.push_back(cell);
      }
      parents = std::move(of_next);
    }
  }

  void place_segments() {
    preamble.head_bytes = 1000;
    std::uint64_t offset = preamble.head_bytes;
    index.segment_offsets.resize(index.segments.size());
    for (std::uint32_t layer = 0; layer < head.layer_ends.size(); ++layer) {
      for (const CellEntry& cell : index.cells) {
        if (layer < head.layer_begin(cell.slab) || layer >= head.slab_ends[cell.slab]) continue;
        const std::uint32_t s = cell.first_segment + layer - head.layer_begin(cell.slab);
        index.segment_offsets[s] = offset;
        offset += index.segments[s].size_bytes;
        preamble.segment_bytes += index.segments[s].size_bytes;
      }
    }
  }

  std::vector<std::byte> write() {
    ByteWriter out;
    write_index(index, head, out);
    preamble.index_bytes = out.size();
    for (std::uint64_t& offset : index.segment_offsets) offset += out.size();
    return out.take();
  }
};

TEST(AssetIndex, ComesBackWhateverItHolds) {
  for (std::uint64_t seed = 0; seed < 150; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    RandomTable table(random);
    const ExactBytes bytes(table.write());
    const auto read = read_index(bytes.view(), table.preamble, table.head, "x");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->base_next_splits, table.index.base_next_splits);
    ASSERT_EQ(read->cells.size(), table.index.cells.size());
    for (std::size_t c = 0; c < read->cells.size(); ++c) {
      const CellEntry& found = read->cells[c];
      const CellEntry& expected = table.index.cells[c];
      ASSERT_EQ(found.parent, expected.parent);
      ASSERT_EQ(found.slab, expected.slab);
      ASSERT_EQ(found.child_count, expected.child_count);
      if (expected.child_count != 0) {
        ASSERT_EQ(found.first_child, expected.first_child);
      }
      ASSERT_EQ(found.first_vertex, expected.first_vertex);
      ASSERT_EQ(found.split_count, expected.split_count);
      ASSERT_EQ(found.cone, expected.cone);
      ASSERT_EQ(found.first_segment, expected.first_segment);
      ASSERT_EQ(found.segment_count, expected.segment_count);
    }
    ASSERT_EQ(read->segments.size(), table.index.segments.size());
    for (std::size_t s = 0; s < read->segments.size(); ++s) {
      ASSERT_EQ(read->segment_offsets[s], table.index.segment_offsets[s]);
      ASSERT_EQ(read->segments[s].size_bytes, table.index.segments[s].size_bytes);
      ASSERT_EQ(read->segments[s].error_code, table.index.segments[s].error_code);
    }
  }
}

TEST(AssetIndex, AnyBytesAreAnErrorOrATableThatAddsUp) {
  for (std::uint64_t seed = 0; seed < 600; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    RandomTable table(random);
    std::vector<std::byte> changed = table.write();
    for (std::uint32_t i = random.below(4); i > 0; --i) {
      changed[random.below(changed.size())] = static_cast<std::byte>(random.below(256));
    }
    if (random.one_in(4)) {
      for (std::byte& b : changed) b = static_cast<std::byte>(random.below(256));
    }
    const ExactBytes bytes(changed);
    const auto read = read_index(bytes.view(), table.preamble, table.head, "x");
    if (!read) {
      EXPECT_TRUE(read.error().message.starts_with("x: cell table: ")) << read.error().message;
      continue;
    }
    ASSERT_EQ(read->base_next_splits.size(), table.head.base.places.size());
    for (const std::uint8_t next : read->base_next_splits) {
      ASSERT_TRUE(next == kNeverSplit || (next >= 1 && next <= table.head.generation_count()));
    }
    std::uint64_t vertices = table.head.base.places.size();
    for (const CellEntry& cell : read->cells) {
      ASSERT_EQ(cell.first_vertex, vertices);
      vertices += cell.split_count;
      ASSERT_LE(cell.cone.width, CodedCone::kWidest);
      ASSERT_LT(cell.cone.u, CodedCone::kPlaces);
      ASSERT_LT(cell.cone.v, CodedCone::kPlaces);
      ASSERT_LE(cell.first_segment + cell.segment_count, read->segments.size());
      if (cell.child_count != 0) {
        ASSERT_LE(cell.first_child + cell.child_count, read->cells.size());
      }
    }
    ASSERT_EQ(vertices, table.head.vertex_count);
    for (std::size_t s = 0; s < read->segments.size(); ++s) {
      ASSERT_LE(read->segment_offsets[s] + read->segments[s].size_bytes, table.preamble.section_bytes());
    }
  }
}

// Which vertices of FM0 are exact is told by the head, and that they are never split by the index.
TEST(AssetIndex, VerticesOfTheBaseAreExactIfTheyAreNeverSplit) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    RandomTable table(random);
    for (const std::uint8_t next : table.index.base_next_splits) {
      table.head.exact_base.push_back(next == kNeverSplit ? 1 : 0);
    }
    const std::vector<std::byte> bytes = table.write();
    ASSERT_TRUE(read_index(bytes, table.preamble, table.head, "x"));
    table.head.exact_base[random.below(table.head.exact_base.size())] ^= 1U;
    const auto read = read_index(bytes, table.preamble, table.head, "x");
    ASSERT_FALSE(read);
    EXPECT_NE(read.error().message.find("vertices of FM0"), std::string::npos) << read.error().message;
  }
}

TEST(AssetIndex, TellsWithWhichSegmentACellsStreamEnds) {
  AssetIndex index;
  for (const std::uint32_t size : {8U, 0U, 2U, 0U}) index.segments.push_back({size, 0});
  CellEntry cell;
  cell.segment_count = 4;
  EXPECT_FALSE(index.is_last_coded(cell, 0));
  EXPECT_FALSE(index.is_last_coded(cell, 1));
  EXPECT_TRUE(index.is_last_coded(cell, 2));
  EXPECT_TRUE(index.is_last_coded(cell, 3));
}

TEST(AssetHead, ComesBackWithItsLayersAndPrecision) {
  std::size_t exact = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    RandomTable table(random);
    AssetHead& head = table.head;
    head.triangle_count = static_cast<std::uint32_t>(head.base.triangles.size());
    head.component_count = 1;
    head.root_cell_count = 1 + random.below(63);
    head.has_pages = head.slab_ends.size() > 1 && random.one_in(2);
    head.grid = PositionGrid::fit({{0, 0, 0}, {1, 2, 3}}, 11);
    std::vector<std::uint8_t> left_out;
    std::uint32_t left = random.one_in(4) ? 0 : random.below(PlacePrecision::most_left_out(head.grid) + 1);
    for (std::uint32_t g = 0; g < head.generation_count(); ++g) {
      left_out.push_back(static_cast<std::uint8_t>(left));
      left -= random.below(left + 1) / 2;
    }
    head.precision = PlacePrecision(left_out, head.grid);
    const PlaceLattice& lattice = head.precision.lattice(0);
    for (GridPoint& place : head.base.places) {
      place = lattice.point_of({random.between(0, 600), random.between(0, 1000), random.between(0, 2000)});
    }
    const std::vector<std::byte> base = encode_base(head.base).value();
    head.base = decode_base(base, head.vertex_count).value();  // in Draco's order
    for (GridPoint& place : head.base.places) {
      const bool is_exact = random.one_in(5);
      if (!lattice.is_exact()) head.exact_base.push_back(is_exact ? 1 : 0);
      const LowBits low = random.below(1U << std::min(lattice.left_out, 31U));
      place = is_exact ? glm::min(LatticeStep(lattice).fine(place, low), lattice.last) : lattice.code_of(place);
    }
    ByteWriter out;
    write_preamble({}, out);
    write_head(head, base, out);
    const ExactBytes bytes(out.view());
    const auto read = read_head(bytes.view(), "x");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->layer_ends, head.layer_ends);
    EXPECT_EQ(read->slab_ends, head.slab_ends);
    EXPECT_EQ(read->root_cell_count, head.root_cell_count);
    EXPECT_EQ(read->has_pages, head.has_pages);
    EXPECT_TRUE(read->precision == head.precision);
    EXPECT_EQ(read->exact_base, head.exact_base);
    EXPECT_EQ(read->base.places, head.base.places);
    exact += head.exact_base.empty() ? 1 : 0;
  }
  EXPECT_GT(exact, 5U);
  EXPECT_LT(exact, 40U);
}

TEST(AssetHead, MoreThanSixtyFourGenerationsAreRefused) {
  const TriangleMesh mesh = testing::make_torus(9, 7);
  AssetHead head;
  std::vector<glm::dvec3> positions = mesh.positions;
  head.grid = PositionGrid::fit(positions, 10);
  for (const glm::dvec3& p : positions) head.base.places.push_back(head.grid.encode(p));
  head.base.triangles = mesh.triangles;
  head.vertex_count = 1000;
  head.triangle_count = 2000;
  head.component_count = 1;
  head.root_cell_count = 1;
  head.slab_ends = {1};
  const std::vector<std::byte> base = encode_base(head.base).value();
  for (const int last : {1, 64, 65, 250, 255}) {
    head.layer_ends = {static_cast<std::uint8_t>(last)};
    ByteWriter out;
    write_preamble({}, out);
    write_head(head, base, out);
    const auto read = read_head(out.view(), "x");
    EXPECT_EQ(read.has_value(), last <= 64) << last;
    if (!read) {
      EXPECT_NE(read.error().message.find("impossible layers"), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace fanstream
