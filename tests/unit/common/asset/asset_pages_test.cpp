// Pages tell of the last slab what the index would: together they say the same, and each can be read by itself.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/support/asset_helpers.h"
#include "tests/support/exact_bytes.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

using testing::OpenAsset;
using testing::SeededRandom;

const OpenAsset& paged() {
  static const OpenAsset built = testing::build_and_open(testing::make_terrain(80, 70, 3));
  return built;
}

AssetIndex first_index() { return *paged().first_index(); }

std::span<const std::byte> page_of(std::uint32_t cell) {
  return paged().segment(cell, paged().index->cells[cell].segment_count);
}

std::vector<std::uint32_t> page_owners() {
  std::vector<std::uint32_t> owners;
  for (std::uint32_t c = paged().index->first_page_owner; c < paged().index->first_paged; ++c) {
    if (!page_of(c).empty()) owners.push_back(c);
  }
  return owners;
}

void expect_same_cells(const AssetIndex& a, const AssetIndex& b) {
  ASSERT_EQ(a.cells.size(), b.cells.size());
  ASSERT_EQ(a.segments.size(), b.segments.size());
  for (std::size_t c = 0; c < a.cells.size(); ++c) {
    SCOPED_TRACE(c);
    ASSERT_EQ(a.cells[c].parent, b.cells[c].parent);
    ASSERT_EQ(a.cells[c].first_child, b.cells[c].first_child);
    ASSERT_EQ(a.cells[c].child_count, b.cells[c].child_count);
    ASSERT_EQ(a.cells[c].first_vertex, b.cells[c].first_vertex);
    ASSERT_EQ(a.cells[c].split_count, b.cells[c].split_count);
    ASSERT_EQ(a.cells[c].first_segment, b.cells[c].first_segment);
    ASSERT_EQ(a.cells[c].cone, b.cells[c].cone);
  }
  for (std::size_t s = 0; s < a.segments.size(); ++s) {
    SCOPED_TRACE(s);
    ASSERT_EQ(a.segments[s].size_bytes, b.segments[s].size_bytes);
    ASSERT_EQ(a.segments[s].error_code, b.segments[s].error_code);
  }
}

TEST(AssetPages, SayWhatAnIndexWithoutPagesSays) {
  BuildOptions options = testing::small_cells();
  options.paged_cells = 1U << 30U;
  const OpenAsset whole = testing::build_and_open(testing::make_terrain(80, 70, 3), options);
  ASSERT_FALSE(whole.head->has_pages);
  ASSERT_TRUE(paged().head->has_pages);
  ASSERT_GT(page_owners().size(), 10U);
  expect_same_cells(*whole.index, *paged().index);
  EXPECT_LT(paged().preamble.index_bytes, whole.preamble.index_bytes);
  for (std::uint32_t c = 0; c < whole.index->cells.size(); ++c) {
    for (std::uint32_t s = 0; s < whole.index->cells[c].segment_count; ++s) {
      ASSERT_TRUE(std::ranges::equal(whole.segment(c, s), paged().segment(c, s)));
    }
  }
}

TEST(AssetPages, AnIndexKnowsAllButTheCellsOfTheLastSlab) {
  const AssetIndex first = first_index();
  EXPECT_EQ(first.unknown_pages, page_owners().size());
  for (std::uint32_t c = 0; c < first.cells.size(); ++c) {
    EXPECT_EQ(first.is_known(c), first.cells[c].slab + 1 < paged().head->slab_count());
    if (first.is_known(c)) continue;
    for (std::uint32_t s = 0; s < first.cells[c].segment_count; ++s) EXPECT_EQ(first.piece_bytes(c, s), kUnknownBytes);
  }
}

TEST(AssetPages, MayComeInAnyOrderAndTwice) {
  SeededRandom random(5);
  for (int round = 0; round < 5; ++round) {
    AssetIndex index = first_index();
    std::vector<std::uint32_t> owners = page_owners();
    for (std::size_t i = owners.size(); i > 1; --i) std::swap(owners[i - 1], owners[random.below(i)]);
    for (const std::uint32_t c : owners) {
      EXPECT_FALSE(index.knows_children(c));
      for (int time = 0; time < 2; ++time) {
        const Result<void> read = read_page(page_of(c), c, *paged().head, index, "x");
        ASSERT_TRUE(read) << read.error().message;
      }
      EXPECT_TRUE(index.knows_children(c));
    }
    EXPECT_EQ(index.unknown_pages, 0U);
    expect_same_cells(index, *paged().index);
    for (std::size_t s = 0; s < index.segments.size(); ++s) {
      ASSERT_EQ(index.segment_offsets[s], paged().index->segment_offsets[s]);
    }
  }
}

// What is announced of the children is what bounds them before they are known.
TEST(AssetPages, AnnounceTheLargestErrorAndAllSplitsOfTheChildren) {
  const AssetIndex& index = *paged().index;
  for (std::uint32_t c = index.first_page_owner; c < index.first_paged; ++c) {
    const CellEntry& cell = index.cells[c];
    std::uint32_t splits = 0;
    std::uint8_t largest = 0;
    for (std::uint32_t child = cell.first_child; child < cell.first_child + cell.child_count; ++child) {
      splits += index.cells[child].split_count;
      largest = std::max(largest, index.segments[index.cells[child].first_segment].error_code);
    }
    EXPECT_EQ(cell.child_splits, splits);
    EXPECT_EQ(cell.rest_code, largest);
    EXPECT_LE(cell.rest_code, index.segments[cell.first_segment + cell.segment_count - 1].error_code);
  }
}

TEST(AssetPages, DamageIsRefusedOrHarmlessAndLeavesTheIndexAsItWas) {
  SeededRandom random(7);
  std::size_t refused = 0, tried = 0;
  for (const std::uint32_t c : page_owners()) {
    for (int round = 0; round < 8; ++round) {
      testing::ExactBytes bytes(page_of(c));
      bytes.flip(random.below(8 * bytes.view().size()));
      AssetIndex index = first_index();
      const Result<void> read = read_page(bytes.view(), c, *paged().head, index, "x");
      ++tried;
      if (read) continue;
      ++refused;
      EXPECT_TRUE(read.error().message.starts_with("x: the page of cell ")) << read.error().message;
      EXPECT_FALSE(index.knows_children(c));
      EXPECT_EQ(index.unknown_pages, page_owners().size());
      ASSERT_TRUE(read_page(page_of(c), c, *paged().head, index, "x"));
    }
  }
  EXPECT_GT(refused, tried * 9 / 10) << "of " << tried;
}

TEST(AssetPages, OfAnotherCellOrSizeAreRefused) {
  AssetIndex index = first_index();
  const std::uint32_t owner = page_owners()[1];
  const auto refuse = [&](std::span<const std::byte> bytes, std::uint32_t cell, const std::string& why) {
    const Result<void> read = read_page(bytes, cell, *paged().head, index, "x");
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
    EXPECT_NE(read.error().message.find(why), std::string::npos) << read.error().message;
  };
  refuse(page_of(owner).first(page_of(owner).size() - 2), owner, "another size");
  refuse({}, owner, "another size");
  refuse(page_of(owner), 0, "does not exist");
  refuse(page_of(owner), index.first_paged, "does not exist");
  refuse(page_of(owner), static_cast<std::uint32_t>(index.cells.size()) + 3, "does not exist");
}

// A client of byte ranges: head, index, the table of ranges, and the pages of one group of parents.
// A few hundred bytes that announce so many cells on pages, each in so many layers.
struct Announcement {
  AssetHead head = *paged().head;
  AssetPreamble preamble;
  std::vector<std::byte> index;

  Announcement(std::uint32_t cells, std::uint32_t layers) {
    constexpr std::uint32_t kParents = 100;
    head.vertex_count = cells + static_cast<std::uint32_t>(head.base.places.size());
    head.root_cell_count = kParents;
    head.has_pages = true;
    head.layer_ends.resize(layers + 1);
    std::iota(head.layer_ends.begin(), head.layer_ends.end(), std::uint8_t{1});
    head.slab_ends = {1, static_cast<std::uint8_t>(layers + 1)};
    head.precision = PlacePrecision({}, head.grid);
    head.exact_base.clear();
    AssetIndex announced;
    announced.base_next_splits.assign(head.base.places.size(), kNeverSplit);
    announced.first_paged = kParents;
    announced.page_starts.sizes.resize(layers);
    announced.page_starts.falls.resize(layers);
    announced.segments.resize(kParents);
    std::uint32_t child = kParents;
    for (std::uint32_t p = 0; p < kParents; ++p) {
      CellEntry& cell = announced.cells.emplace_back();
      cell.first_segment = p;
      cell.segment_count = 1;
      cell.page_bytes = 2;
      cell.first_child = child;
      cell.child_count = cell.child_splits = cells / kParents + (p < cells % kParents ? 1 : 0);
      child += cell.child_count;
    }
    ByteWriter out;
    write_index(announced, head, out);
    index = out.take();
    preamble.head_bytes = kPreambleBytes + 1000;
    preamble.index_bytes = index.size();
    preamble.segment_bytes = std::uint64_t{1} << 40U;
  }
  Result<AssetIndex> read() const { return read_index(index, preamble, head, "x.fan"); }
};

TEST(AssetPages, MoreCellsOrSegmentsThanTheMostAreRefused) {
  EXPECT_TRUE(Announcement(5'000, 63).read());
  // The last has more segments than 32 bits count.
  for (const auto& [cells, layers] :
       {std::pair{kMostCells, 1U}, {2'000'000U, 40U}, {kMostVertices - 1000, 63U}, {68'174'084U, 63U}}) {
    const Announcement announced(cells, layers);
    EXPECT_LT(announced.index.size(), 3'000U);
    const Result<AssetIndex> read = announced.read();
    ASSERT_FALSE(read) << cells << " cells";
    EXPECT_EQ(read.error().kind, ErrorKind::limit);
    EXPECT_NE(read.error().message.find("more than 4194304 cells"), std::string::npos) << read.error().message;
  }
}

TEST(AssetPages, MoreVerticesThanAllBytesCouldTellAreRefused) {
  Announcement announced(200'000, 2);
  EXPECT_TRUE(announced.read());
  announced.preamble.segment_bytes = 500;
  const Result<AssetIndex> read = announced.read();
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().kind, ErrorKind::limit);
  EXPECT_NE(read.error().message.find("are not believed"), std::string::npos) << read.error().message;
}

TEST(AssetPages, TheTableOfRangesAndOneGroupOfPagesGiveThePlacesOfSegments) {
  BuildOptions options = testing::small_cells();
  options.slab_growth = 2.0;
  options.cell_vertices = 8;
  const OpenAsset asset = testing::build_and_open(testing::make_terrain(120, 110, 3), options);
  const AssetIndex& all = *asset.index;
  const std::uint32_t parents = all.first_paged - all.first_page_owner;
  ASSERT_GT(parents, 2 * kRangeParents);
  const std::uint32_t layers = asset.head->layers_of(asset.head->slab_count() - 1);
  ByteReader table(std::span(asset.bytes).subspan(all.paged_end));
  std::vector<std::uint32_t> sums;
  for (std::uint64_t i = 0; i < range_table_bytes(*asset.head, all) / 4; ++i) sums.push_back(table.u32());
  for (std::uint32_t group = 0; group * kRangeParents < parents; ++group) {
    AssetIndex index = *asset.first_index();
    const std::uint32_t first = all.first_page_owner + group * kRangeParents;
    const std::uint32_t end = std::min(first + kRangeParents, all.first_paged);
    for (std::uint32_t c = first; c < end; ++c) {
      const auto page = std::span(asset.bytes).subspan(index.cells[c].page_offset, index.cells[c].page_bytes);
      if (page.empty()) continue;
      ASSERT_TRUE(read_page(page, c, *asset.head, index, "x"));
    }
    std::uint64_t at = index.paged_offset;
    for (std::uint32_t s = 0; s < layers; ++s) {
      std::uint64_t place = at;
      for (std::uint32_t g = 0; g < group; ++g) place += sums[g * layers + s];
      for (std::uint32_t c = first; c < end; ++c) {
        const CellEntry& parent = index.cells[c];
        for (std::uint32_t child = parent.first_child; child < parent.first_child + parent.child_count; ++child) {
          ASSERT_EQ(place, all.piece_offset(child, s)) << "cell " << child << " segment " << s;
          place += index.piece_bytes(child, s);
        }
      }
      for (std::size_t g = s; g < sums.size(); g += layers) at += sums[g];
    }
    EXPECT_EQ(at, index.paged_end);
  }
}

}  // namespace
}  // namespace fanstream
