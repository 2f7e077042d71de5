// One rANS stream cut into segments.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "tests/support/exact_bytes.h"
#include "tests/unit/common/coding/rans_message.h"

namespace fanstream {
namespace {

using testing::code;
using testing::ExactBytes;
using testing::Message;
using testing::random_message;
using testing::SeededRandom;

using Segments = std::vector<std::vector<std::byte>>;

// Ascending numbers of steps before each cut; some cuts at the same place, at the start or at the end.
std::vector<std::size_t> random_cuts(SeededRandom& random, std::size_t steps) {
  std::vector<std::size_t> cuts;
  for (std::uint32_t i = random.below(12); i > 0; --i) cuts.push_back(random.below(steps + 1));
  if (random.one_in(3)) cuts.insert(cuts.end(), 1 + random.below(2), 0);
  if (random.one_in(3)) cuts.insert(cuts.end(), 1 + random.below(2), steps);
  if (!cuts.empty() && random.one_in(3)) cuts.insert(cuts.end(), 2, cuts.front());
  std::sort(cuts.begin(), cuts.end());
  return cuts;
}

Segments encoded(const Message& message, const std::vector<std::size_t>& cuts) {
  RansEncoder encoder;
  std::size_t step = 0;
  for (const std::size_t cut : cuts) {
    for (; step < cut; ++step) code(encoder, message, message.steps[step]);
    encoder.cut();
  }
  for (; step < message.steps.size(); ++step) code(encoder, message, message.steps[step]);
  return encoder.finish_segments();
}

struct CutMessage {
  Message message;
  std::vector<std::size_t> cuts;
  std::vector<ExactBytes> segments;

  explicit CutMessage(SeededRandom& random, std::size_t most_steps = 400)
      : message(random_message(random, random.below(most_steps), 1 + random.below(9))),
        cuts(random_cuts(random, message.steps.size())) {
    for (const auto& bytes : encoded(message, cuts)) segments.emplace_back(bytes);
  }
  std::size_t begin(std::size_t segment) const { return segment == 0 ? 0 : cuts[segment - 1]; }
  std::size_t end(std::size_t segment) const { return segment < cuts.size() ? cuts[segment] : message.steps.size(); }
  // Whether no later segment has bytes.
  bool ends(std::size_t segment) const {
    return std::all_of(segments.begin() + static_cast<std::ptrdiff_t>(segment) + 1, segments.end(),
                       [](const ExactBytes& bytes) { return bytes.view().empty(); });
  }
  void append(RansDecoder& decoder, std::size_t segment) const {
    decoder.append(segments[segment].view(), ends(segment));
  }
  // Whether all of a segment's symbols come out as they went in.
  bool decodes(RansDecoder& decoder, std::size_t segment) const {
    bool same = true;
    for (std::size_t i = begin(segment); i < end(segment); ++i) {
      same &= code(decoder, message, message.steps[i]) == message.steps[i].value;
    }
    return same;
  }
};

TEST(RansCuts, SegmentsComeBackOneByOne) {
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const CutMessage cut(random);
    ASSERT_EQ(cut.segments.size(), cut.cuts.size() + 1);
    RansDecoder decoder;
    for (std::size_t s = 0; s < cut.segments.size(); ++s) {
      ASSERT_TRUE(decoder.used_up());
      cut.append(decoder, s);
      ASSERT_TRUE(cut.decodes(decoder, s)) << "segment " << s;
      ASSERT_TRUE(decoder.used_up()) << "segment " << s;
      ASSERT_FALSE(decoder.starved());
    }
    ASSERT_TRUE(decoder.finished_cleanly());
  }
}

// So that cutting costs nothing.
TEST(RansCuts, SegmentsTogetherAreTheUncutStream) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const CutMessage cut(random);
    std::vector<std::byte> together;
    for (const ExactBytes& s : cut.segments) together.insert(together.end(), s.view().begin(), s.view().end());
    ASSERT_EQ(together, encoded(cut.message, {}).front());
  }
}

TEST(RansCuts, SegmentsWithoutSymbolsHaveNoBytes) {
  SeededRandom random(3);
  const Message message = random_message(random, 300, 5);
  // First, in the middle, last; several times each.
  const Segments segments = encoded(message, {0, 0, 150, 150, 150, 300, 300});
  ASSERT_EQ(segments.size(), 8U);
  for (const std::size_t empty : {0, 1, 3, 4, 6, 7}) EXPECT_TRUE(segments[empty].empty()) << "segment " << empty;
  EXPECT_FALSE(segments[2].empty());
  EXPECT_FALSE(segments[5].empty());
  for (const std::vector<std::byte>& only_cuts : encoded({}, {0, 0, 0})) EXPECT_TRUE(only_cuts.empty());
}

// A symbol or two seldom need a word of their own.
TEST(RansCuts, SegmentsWithSymbolsMayHaveNoBytes) {
  std::size_t found = 0;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    SeededRandom random(seed);
    const CutMessage cut(random, 12);
    for (std::size_t s = 0; s < cut.segments.size(); ++s) {
      found += cut.begin(s) < cut.end(s) && cut.segments[s].view().empty() ? 1 : 0;
    }
  }
  EXPECT_GT(found, 20U);
}

TEST(RansCuts, AnEncoderIsEmptyAfterItHasFinished) {
  SeededRandom random(5);
  const Message message = random_message(random, 60, 5);
  RansEncoder encoder;
  for (int round = 0; round < 2; ++round) {
    for (const auto& step : message.steps) code(encoder, message, step);
    encoder.cut();
    const Segments segments = encoder.finish_segments();
    ASSERT_EQ(segments.size(), 2U);
    EXPECT_EQ(segments.front(), encoded(message, {}).front());
  }
  EXPECT_EQ(encoder.finish_segments(), Segments(1));
}

// A copy taken between segments goes on as the decoder itself did: that is how refinement is undone and done again.
TEST(RansCuts, ADecoderCanBeTakenBackToAnyCut) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const CutMessage cut(random);
    std::vector<RansDecoder> before;
    RansDecoder decoder;
    for (std::size_t s = 0; s < cut.segments.size(); ++s) {
      before.push_back(decoder);
      cut.append(decoder, s);
      ASSERT_TRUE(cut.decodes(decoder, s));
    }
    for (std::size_t from = before.size(); from-- > 0;) {
      RansDecoder again = before[from];
      for (std::size_t s = from; s < cut.segments.size(); ++s) {
        cut.append(again, s);
        ASSERT_TRUE(cut.decodes(again, s)) << "segment " << s << " from " << from;
      }
      ASSERT_TRUE(again.finished_cleanly());
    }
  }
}

// A state that has run down is no state to go on with. With the last segment it may, and a stream that has not begun
// has none.
TEST(RansCuts, EveryTruncatedSegmentButTheLastIsNoticedAtItsEnd) {
  std::size_t tried = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const CutMessage cut(random);
    RansDecoder decoder;
    bool begun = false;
    for (std::size_t s = 0; s < cut.segments.size() && !cut.ends(s); ++s) {
      const auto whole = cut.segments[s].view();
      for (std::size_t size = begun ? 0 : 1; size < whole.size(); ++size) {
        const ExactBytes shorter(whole.first(size));
        RansDecoder misled = decoder;
        misled.append(shorter.view(), false);
        (void)cut.decodes(misled, s);
        ++tried;
        ASSERT_TRUE(misled.starved()) << "segment " << s << " cut to " << size;
        ASSERT_FALSE(misled.used_up());
      }
      begun = begun || !whole.empty();
      cut.append(decoder, s);
      ASSERT_TRUE(cut.decodes(decoder, s));
    }
  }
  EXPECT_GT(tried, 2000U);
}

// While later segments have bytes, a decoder's state is full and takes no word that was not meant for it.
TEST(RansCuts, SurplusBytesAreNoticedAtTheSegmentsEnd) {
  std::size_t tried = 0;
  std::size_t missed = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const CutMessage cut(random);
    RansDecoder decoder;
    bool begun = false;
    for (std::size_t s = 0; s < cut.segments.size(); ++s) {
      begun |= !cut.segments[s].view().empty();  // before that, bytes are taken for the state
      std::vector<std::byte> longer(cut.segments[s].view().begin(), cut.segments[s].view().end());
      for (std::size_t surplus = 1; surplus <= 4 && begun; ++surplus) {
        longer.push_back(std::byte{1});
        const ExactBytes bytes(longer);
        RansDecoder misled = decoder;
        misled.append(bytes.view(), cut.ends(s));
        const bool same = cut.decodes(misled, s);
        if (cut.ends(s)) {
          ++tried;
          missed += static_cast<std::size_t>(misled.finished_cleanly());
          continue;
        }
        ASSERT_TRUE(same || surplus % 2 != 0);
        ASSERT_FALSE(misled.used_up()) << "segment " << s << " and " << surplus << " bytes";
      }
      cut.append(decoder, s);
      ASSERT_TRUE(cut.decodes(decoder, s));
    }
  }
  std::printf("[  figures ] %zu of %zu surpluses behind last segments went unnoticed\n", missed, tried);
  EXPECT_LT(static_cast<double>(missed), 0.02 * static_cast<double>(tried));
}

TEST(RansCuts, SegmentsOfAnyBytesAreSafe) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const Message message = random_message(random, 200, 3);
    RansDecoder decoder;
    std::vector<ExactBytes> segments;
    for (const auto& step : message.steps) {
      if (decoder.used_up() && random.one_in(4)) {
        std::vector<std::byte> noise(random.below(9));
        for (std::byte& b : noise) b = static_cast<std::byte>(random.below(256));
        segments.emplace_back(noise);
        decoder.append(segments.back().view(), random.one_in(2));
      }
      ASSERT_LT(code(decoder, message, step), value_count(message, step));
    }
  }
}

}  // namespace
}  // namespace fanstream
