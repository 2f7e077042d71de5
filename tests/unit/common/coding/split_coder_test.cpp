#include "common/coding/split_coder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>

#include "common/refine/cell_coder.h"
#include "tests/support/exact_bytes.h"
#include "tests/unit/common/coding/random_ring.h"

namespace fanstream {
namespace {

using testing::ExactBytes;
using testing::RandomRing;
using testing::SeededRandom;

struct CodedCase {
  RandomRing ring;
  FanSplit split;
  std::uint8_t root_next;
  std::uint8_t added_next;
};

// What is coded against: when the vertices of all rings are split next, by number.
struct Surroundings {
  CodingTime time;
  std::vector<FanVertex> vertices;

  explicit Surroundings(SeededRandom& random, std::uint32_t last = 0) : vertices(300) {
    time.last = last != 0 ? last : 1 + random.below(kMostGenerations);
    time.generation = 1 + random.below(time.last);
    for (FanVertex& v : vertices) {
      if (!random.one_in(3)) v.context.next = any_generation(random, time.generation + 1);
    }
    vertices[0].context.next = static_cast<std::uint8_t>(time.generation);  // the root's
  }
  std::uint8_t any_generation(SeededRandom& random, std::uint32_t first) const {
    return first > time.last ? kNeverSplit : static_cast<std::uint8_t>(first + random.below(time.last - first + 1));
  }
  std::vector<FanVertex> with_next_splits(std::vector<FanVertex> placed) const {
    for (std::size_t v = 0; v < placed.size(); ++v) placed[v].context = vertices[v].context;
    return placed;
  }
  bool taken(const RandomRing& ring, std::uint32_t from, std::uint32_t to, std::uint8_t generation) const {
    const auto size = static_cast<std::uint32_t>(ring.ring.size());
    for (std::uint32_t i = from;; i = (i + 1) % size) {
      if (ring.ring[i] != kOutside && vertices[ring.ring[i]].context.next == generation) return true;
      if (i == to) return false;
    }
  }
  // Any that the format allows: no neighbour's, nor both the same; the root once more in this generation, the new
  // vertex not.
  void choose_next_splits(CodedCase& c, SeededRandom& random) const {
    c.root_next = any_generation(random, time.generation);
    if (taken(c.ring, c.split.last, c.split.first, c.root_next)) c.root_next = kNeverSplit;
    c.added_next = any_generation(random, time.generation + 1);
    if (c.added_next == c.root_next || taken(c.ring, c.split.first, c.split.last, c.added_next)) {
      c.added_next = kNeverSplit;
    }
  }
};

std::vector<CodedCase> random_cases(SeededRandom& random, const Surroundings& around, int count, std::int32_t reach,
                                    std::int32_t displacement) {
  std::vector<CodedCase> cases;
  for (int i = 0; i < count; ++i) {
    const std::uint32_t size = random.one_in(20) ? 3 + random.below(200) : 3 + random.below(14);
    CodedCase c{RandomRing(random, size, random.one_in(3), reach), {}, kNeverSplit, kNeverSplit};
    c.split.first = random.below(size);
    c.split.last = (c.split.first + 1 + random.below(size - 1)) % size;
    c.split.parent = static_cast<ParentPosition>(random.below(3));
    const auto coordinate = [&] { return random.between(-displacement, displacement); };
    c.split.displacement = {coordinate(), coordinate(), coordinate()};
    c.split.shift = {coordinate(), coordinate(), coordinate()};
    around.choose_next_splits(c, random);
    cases.push_back(std::move(c));
  }
  return cases;
}

// The splits of `cases` as they go into a coder: as an encoder gets them, or as a decoder does, which knows the rings
// only.
std::vector<SplitInProgress> in_progress(const std::vector<CodedCase>& cases, const glm::vec3& unit,
                                         const Surroundings& around, bool known) {
  std::vector<SplitInProgress> all(cases.size());
  for (std::size_t i = 0; i < cases.size(); ++i) {
    all[i].ring.assign(cases[i].ring.fans, 0, around.with_next_splits(cases[i].ring.vertices), float4(unit));
    all[i].split = known ? cases[i].split : FanSplit{0, 0, 1, ParentPosition::kept, {}};
    all[i].root_next = known ? cases[i].root_next : kNeverSplit;
    all[i].added_next = known ? cases[i].added_next : kNeverSplit;
  }
  return all;
}

template <class Coder>
void code_by_batches(Coder& coder, const SplitModel& model, const glm::vec3& unit, const Surroundings& around,
                     std::vector<SplitInProgress>& splits, std::size_t batch) {
  for (std::size_t begin = 0; begin < splits.size(); begin += batch) {
    code_splits(coder, model, AxisUnits(unit), around.time,
                std::span(splits).subspan(begin, std::min(batch, splits.size() - begin)));
  }
}

void expect_splits(std::span<const SplitInProgress> found, std::span<const CodedCase> cases) {
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const FanSplit& expected = cases[i].split;
    ASSERT_EQ(found[i].split.first, expected.first) << "split " << i;
    ASSERT_EQ(found[i].split.last, expected.last) << "split " << i;
    ASSERT_EQ(found[i].split.parent, expected.parent) << "split " << i;
    ASSERT_EQ(found[i].split.displacement, expected.displacement) << "split " << i;
    if (expected.parent == ParentPosition::free) {
      ASSERT_EQ(found[i].split.shift, expected.shift) << "split " << i;
    }
    ASSERT_EQ(found[i].root_next, cases[i].root_next) << "split " << i;
    ASSERT_EQ(found[i].added_next, cases[i].added_next) << "split " << i;
  }
}

void expect_round_trip(const std::vector<CodedCase>& cases, const SplitModel& model, const glm::vec3& unit,
                       const Surroundings& around, std::size_t batch = CellCoding::kBatch) {
  RansEncoder encoder;
  std::vector<SplitInProgress> given = in_progress(cases, unit, around, true);
  code_by_batches(encoder, model, unit, around, given, batch);
  expect_splits(given, cases);
  const ExactBytes bytes(encoder.finish());
  RansDecoder decoder(bytes.view());
  std::vector<SplitInProgress> found = in_progress(cases, unit, around, false);
  code_by_batches(decoder, model, unit, around, found, batch);
  expect_splits(found, cases);
  ASSERT_TRUE(decoder.finished_cleanly());
}

TEST(SplitCoder, FreeParentsComeBack) {
  SplitStatistics statistics = SplitStatistics::built_in();
  statistics.allow_free_parents();
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    for (std::int8_t& w : statistics.free_parent.weights) w = static_cast<std::int8_t>(random.between(-128, 127));
    for (std::int8_t& s : statistics.free_parent.spreads) s = static_cast<std::int8_t>(random.between(-64, 127));
    const Surroundings around(random);
    std::vector<CodedCase> cases = random_cases(random, around, 60, random.one_in(2) ? 30 : 20'000, kMostShift);
    for (CodedCase& c : cases) {
      if (random.one_in(2)) c.split.parent = ParentPosition::free;
    }
    expect_round_trip(cases, SplitModel(statistics), {1.0F, random.one_in(2) ? 1.0F : 7.5F, 1.0F}, around);
  }
}

TEST(SplitCoder, SplitsComeBack) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const Surroundings around(random);
    const std::int32_t reach = 1 << random.below(12);
    const SplitModel model;
    expect_round_trip(random_cases(random, around, 150, reach, reach), model, glm::vec3(1.0F), around);
  }
}

TEST(SplitCoder, SplitsAcrossTheWholeGridComeBackOnAnisotropicGrids) {
  constexpr std::int32_t kFar = (1 << 20) - 1;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const Surroundings around(random);
    const SplitModel model;
    expect_round_trip(random_cases(random, around, 100, kFar / 2, kFar), model, glm::vec3(1.0F, 1.0F, 40.0F), around);
    expect_round_trip(random_cases(random, around, 100, 3, kFar), model, glm::vec3(1.0F, 1000.0F, 1.0F), around);
  }
}

TEST(SplitCoder, SplitsComeBackWithOtherStatistics) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const Surroundings around(random);
    SplitStatistics statistics;
    for (auto& table : statistics.symbols) {
      for (std::uint8_t& share : table) share = static_cast<std::uint8_t>(random.below(64));
    }
    for (auto& weights : statistics.weights) {
      for (std::int8_t& w : weights) w = static_cast<std::int8_t>(random.between(-128, 127));
    }
    statistics.spreads = SplitStatistics::built_in().spreads;
    for (std::int8_t& s : statistics.spreads) s = static_cast<std::int8_t>(s + random.between(-8, 8));
    for (std::int8_t& s : statistics.scales) s = static_cast<std::int8_t>(random.between(-8, 8));
    const SplitModel model(statistics);
    expect_round_trip(random_cases(random, around, 100, 300, 300), model, glm::vec3(1.0F, 2.0F, 1.0F), around);
  }
}

TEST(SplitCoder, EveryArcOfEveryRingComesBack) {
  const SplitModel model;
  SeededRandom random(11);
  const Surroundings around(random, 12);
  std::vector<CodedCase> cases;
  for (std::uint32_t size = 3; size <= 9; ++size) {
    for (const bool open : {false, true}) {
      for (std::uint32_t first = 0; first < size; ++first) {
        for (std::uint32_t step = 1; step < size; ++step) {
          for (int parent = 0; parent < 3; ++parent) {
            CodedCase c{RandomRing(random, size, open, 20), {}, kNeverSplit, kNeverSplit};
            c.split = {0, first, (first + step) % size, static_cast<ParentPosition>(parent), {1, -2, 3}};
            around.choose_next_splits(c, random);
            cases.push_back(std::move(c));
          }
        }
      }
    }
  }
  expect_round_trip(cases, model, glm::vec3(1.0F), around);
}

TEST(SplitCoder, SplitsComeBackFromBatchesOfAnySize) {
  for (std::size_t batch = 1; batch <= CellCoding::kBatch; ++batch) {
    SCOPED_TRACE("batches of " + std::to_string(batch));
    SeededRandom random(batch);
    const Surroundings around(random);
    const SplitModel model;
    for (const int count : {0, 1, 7, 16, 17, 100}) {
      expect_round_trip(random_cases(random, around, count, 90, 90), model, glm::vec3(1.0F, 1.0F, 2.0F), around, batch);
      if (HasFatalFailure()) return;
    }
  }
}

// Which symbols of which tables it was given, in order.
struct RecordingCoder {
  static constexpr bool kDecodes = false;
  std::vector<std::pair<const FrequencyTable*, int>> steps;
  int symbol(const FrequencyTable& table, int value) {
    steps.emplace_back(&table, value);
    return value;
  }
  unsigned bits(int count, unsigned value) {
    if (count != 0) steps.emplace_back(nullptr, static_cast<int>(value) << 4 | count);
    return value;
  }
};

// Only the order of symbols differs: what is predicted for a split does not depend on those beside it.
TEST(SplitCoder, BatchesOfAnySizeCodeTheSameSymbols) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const SplitModel model;
    const Surroundings around(random);
    const auto cases = random_cases(random, around, 100, 300, 300);
    std::vector<std::pair<const FrequencyTable*, int>> expected;
    for (std::size_t batch = 1; batch <= CellCoding::kBatch; ++batch) {
      RecordingCoder coder;
      std::vector<SplitInProgress> splits = in_progress(cases, glm::vec3(1.0F), around, true);
      code_by_batches(coder, model, glm::vec3(1.0F), around, splits, batch);
      std::sort(coder.steps.begin(), coder.steps.end());
      if (batch == 1) expected = coder.steps;
      ASSERT_TRUE(coder.steps == expected) << "batches of " << batch;
    }
  }
}

// What a batch held before must not show: they are used again and again.
TEST(SplitCoder, SplitsOfSeveralStreamsComeBackSideBySide) {
  std::vector<const RingKernels*> all_kernels{&RingKernels::portable()};
  if (RingKernels::avx2() != nullptr) all_kernels.push_back(RingKernels::avx2());
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    SplitStatistics statistics = SplitStatistics::built_in();
    if (random.one_in(2)) statistics.allow_free_parents();
    const SplitModel model(statistics);
    const Surroundings around(random);
    const glm::vec3 unit(1.0F);
    const int reach = random.one_in(4) ? 20'000 : 30;  // far ones escape
    std::vector<CodedCase> cases =
        random_cases(random, around, 1 + static_cast<int>(random.below(AxisChains::kMost)), reach, reach);
    if (statistics.has_free_parents) {
      for (CodedCase& c : cases) c.split.parent = random.one_in(3) ? ParentPosition::free : c.split.parent;
    }
    std::vector<SplitInProgress> given = in_progress(cases, unit, around, true);
    std::vector<std::size_t> sizes;
    std::vector<ExactBytes> streams;
    for (std::size_t begin = 0; begin < cases.size(); begin += sizes.back()) {
      sizes.push_back(1 + random.below(std::min<std::size_t>(cases.size() - begin, 5)));
      RansEncoder encoder;
      code_splits(encoder, model, AxisUnits(unit), around.time, std::span(given).subspan(begin, sizes.back()));
      streams.emplace_back(encoder.finish());
    }
    for (const RingKernels* kernels : all_kernels) {
      std::vector<RansDecoder> decoders(streams.size());
      std::vector<DecoderRun> runs;
      for (std::size_t i = 0; i < streams.size(); ++i) {
        decoders[i] = RansDecoder(streams[i].view());
        runs.push_back({&decoders[i], sizes[i]});
      }
      std::vector<SplitInProgress> found = in_progress(cases, unit, around, false);
      decode_splits(runs, model, AxisUnits(unit), around.time, found, {}, *kernels);
      expect_splits(found, cases);
      for (const RansDecoder& decoder : decoders) ASSERT_TRUE(decoder.finished_cleanly()) << kernels->name;
    }
  }
}

TEST(SplitCoder, ABatchCanBeUsedAgain) {
  const SplitModel model;
  const glm::vec3 unit(1.0F);
  SeededRandom random(14);
  const Surroundings around(random);
  const auto cases = random_cases(random, around, 400, 200, 200);
  RansEncoder encoder;
  std::vector<SplitInProgress> given = in_progress(cases, unit, around, true);
  code_by_batches(encoder, model, unit, around, given, 16);
  const ExactBytes bytes(encoder.finish());
  RansDecoder decoder(bytes.view());
  std::array<SplitInProgress, 16> batch;
  for (std::size_t begin = 0; begin < cases.size(); begin += batch.size()) {
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const CodedCase& c = cases[begin + i];
      batch[i].ring.assign(c.ring.fans, 0, around.with_next_splits(c.ring.vertices), float4(unit));
    }
    code_splits(decoder, model, AxisUnits(unit), around.time, std::span(batch));
    expect_splits(batch, std::span(cases).subspan(begin, batch.size()));
    if (HasFatalFailure()) return;
  }
  ASSERT_TRUE(decoder.finished_cleanly());
}

TEST(SplitCoder, AnyBytesGiveALegalSplit) {
  const SplitModel model;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    std::vector<std::byte> noise(random.below(200));
    for (std::byte& b : noise) b = static_cast<std::byte>(random.below(256));
    const ExactBytes bytes(noise);
    RansDecoder decoder(bytes.view());
    const Surroundings around(random);
    const auto cases = random_cases(random, around, 30, 50, 0);
    std::vector<SplitInProgress> splits = in_progress(cases, glm::vec3(1.0F), around, false);
    code_by_batches(decoder, model, glm::vec3(1.0F), around, splits, 1 + random.below(16));
    for (std::size_t i = 0; i < splits.size(); ++i) {
      const SplitInProgress& s = splits[i];
      ASSERT_LT(s.split.first, s.ring.size());
      ASSERT_LT(s.split.last, s.ring.size());
      ASSERT_NE(s.split.first, s.split.last);
      ASSERT_LE(static_cast<int>(s.split.parent), 2);
      for (int axis = 0; axis < 3; ++axis) ASSERT_LE(std::abs(s.split.displacement[axis]), 1 << 28);
      if (s.root_next != kNeverSplit) {
        ASSERT_GE(s.root_next, around.time.generation);
        ASSERT_LE(s.root_next, around.time.last);
        ASSERT_FALSE(around.taken(cases[i].ring, s.split.last, s.split.first, s.root_next));
      }
      if (s.added_next != kNeverSplit) {
        ASSERT_GT(s.added_next, around.time.generation);
        ASSERT_LE(s.added_next, around.time.last);
        ASSERT_NE(s.added_next, s.root_next);
        ASSERT_FALSE(around.taken(cases[i].ring, s.split.first, s.split.last, s.added_next));
      }
    }
  }
}

TEST(SplitCoder, PredictionsFollowTheRing) {
  // Features are sums of spokes, so a ring twice as large predicts a place twice as far.
  const SplitModel model;
  SeededRandom random(5);
  RandomRing small(random, 6, false, 64);
  RandomRing large = small;
  for (FanVertex& v : large.vertices) v.place = 2 * v.place;
  const auto mean_of = [&](const RandomRing& ring) {
    SplitInProgress s;
    s.ring.assign(ring.fans, 0, ring.vertices, Float4{1.0F, 1.0F, 1.0F, 0.0F});
    s.split = {0, 1, 3, ParentPosition::kept, {}};
    return to_vec3(RingKernels::best().predict(model.phase(0), s).mean);
  };
  EXPECT_EQ(2.0F * mean_of(small), mean_of(large));
}

}  // namespace
}  // namespace fanstream
