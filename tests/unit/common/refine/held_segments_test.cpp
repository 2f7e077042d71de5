#include "common/refine/held_segments.h"

#include <gtest/gtest.h>

#include <map>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

std::shared_ptr<const AssetIndex> random_index(SeededRandom& random) {
  auto index = std::make_shared<AssetIndex>();
  for (int c = 0; c < 20; ++c) {
    CellEntry cell;
    cell.first_segment = static_cast<std::uint32_t>(index->segments.size());
    cell.segment_count = 1 + random.below(9);
    for (std::uint32_t s = 0; s < cell.segment_count; ++s) {
      SegmentEntry segment;
      segment.size_bytes = random.one_in(4) ? 0 : 2 * random.below(40);
      index->segments.push_back(segment);
    }
    index->cells.push_back(cell);
  }
  return index;
}

TEST(HeldSegments, AreWhatWasAddedAndNotReleased) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const auto index = random_index(random);
    HeldSegments held(index);
    const std::size_t empty_bytes = held.memory_bytes();
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::byte>> expected;
    std::size_t total = 0;
    const auto size_of = [&](std::uint32_t c, std::uint32_t s) {
      return index->segments[index->cells[c].first_segment + s].size_bytes;
    };
    for (int step = 0; step < 300; ++step) {
      const std::uint32_t cell = random.below(index->cells.size());
      const std::uint32_t segment = random.below(index->cells[cell].segment_count + 1);
      if (random.one_in(4)) {
        std::size_t freed = 0;
        for (std::uint32_t s = segment; s < index->cells[cell].segment_count; ++s) {
          const auto found = expected.find({cell, s});
          if (found == expected.end()) continue;
          freed += found->second.size();
          expected.erase(found);
        }
        ASSERT_EQ(held.release(cell, segment), freed);
        total -= freed;
      } else if (segment < index->cells[cell].segment_count && !held.holds(cell, segment)) {
        std::vector<std::byte> bytes(size_of(cell, segment));
        for (std::byte& b : bytes) b = static_cast<std::byte>(random.below(256));
        held.add(cell, segment, bytes);
        total += bytes.size();
        expected[{cell, segment}] = std::move(bytes);
      }
      for (std::uint32_t c = 0; c < index->cells.size(); ++c) {
        std::uint32_t prefix = 0;
        bool gap = false;
        for (std::uint32_t s = 0; s < index->cells[c].segment_count; ++s) {
          const auto found = expected.find({c, s});
          const bool is_held = found != expected.end() || size_of(c, s) == 0;
          ASSERT_EQ(held.holds(c, s), is_held);
          const auto bytes = held.bytes(c, s);
          if (found != expected.end()) {
            ASSERT_TRUE(std::equal(bytes.begin(), bytes.end(), found->second.begin()));
          }
          ASSERT_EQ(bytes.size(), is_held ? size_of(c, s) : 0U);
          gap |= !is_held;
          prefix += gap ? 0 : 1;
        }
        ASSERT_EQ(held.prefix(c), prefix);
      }
      ASSERT_EQ(held.memory_bytes(), empty_bytes + total);
    }
  }
}

}  // namespace
}  // namespace fanstream
