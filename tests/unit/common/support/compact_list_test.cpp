#include "common/support/compact_list.h"

#include <gtest/gtest.h>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

struct Odd {
  std::uint8_t bytes[3];
  friend bool operator==(const Odd&, const Odd&) = default;
};

template <class T>
T value_of(std::uint32_t random) {
  if constexpr (std::is_same_v<T, Odd>) {
    return {{std::uint8_t(random), std::uint8_t(random >> 8U), std::uint8_t(random >> 16U)}};
  } else {
    return static_cast<T>(random);
  }
}

template <class T>
void expect_like_vector(std::uint64_t seed) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  SeededRandom random(seed);
  CompactList<T> list;
  std::vector<T> expected;
  const auto some = [&] {
    std::vector<T> values(random.below(40));
    for (T& v : values) v = value_of<T>(random.below(1U << 24U));
    return values;
  };
  for (int step = 0; step < 500; ++step) {
    const std::vector<T> values = some();
    switch (random.below(9)) {
      case 0:
        list.assign(values);
        expected = values;
        break;
      case 1:
        list.append(values);
        expected.insert(expected.end(), values.begin(), values.end());
        break;
      case 2:
        list.resize(values.size());
        expected.resize(values.size());
        break;
      case 3: {
        const CompactList<T> copy = list;
        list = CompactList<T>(values);
        list = copy;
        break;
      }
      case 4: {
        CompactList<T> moved = std::move(list);
        list = std::move(moved);
        break;
      }
      case 5:
        if (!expected.empty()) {
          const T out = expected[random.below(expected.size())];
          list.erase_if([&](const T& v) { return v == out; });
          std::erase(expected, out);
        }
        break;
      case 6:
        for (std::uint32_t left = random.below(expected.size() + 1); left > 0; --left) {
          list.pop_back();
          expected.pop_back();
        }
        break;
      default:
        list.push_back(expected.empty() || random.one_in(2) ? value_of<T>(random.below(1U << 24U)) : list[0]);
        expected.push_back(list.back());
    }
    ASSERT_EQ(list.size(), expected.size());
    ASSERT_EQ(list.empty(), expected.empty());
    ASSERT_GE(list.capacity(), list.size());
    ASSERT_EQ(list.memory_bytes() == 0, list.capacity() == 0);
    const std::span<const T> span = list;
    ASSERT_TRUE(std::equal(span.begin(), span.end(), expected.begin(), expected.end())) << "step " << step;
  }
}

TEST(CompactList, HoldsWhatAVectorWould) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    expect_like_vector<std::uint32_t>(seed);
    expect_like_vector<Odd>(seed + 100);
    expect_like_vector<std::uint64_t>(seed + 200);
  }
}

TEST(CompactList, CostsAPointerAndLittleMoreThanItsElements) {
  static_assert(sizeof(CompactList<std::uint32_t>) == sizeof(void*));
  EXPECT_EQ(CompactList<std::uint32_t>().memory_bytes(), 0U);
  for (std::size_t count = 1; count < 300; ++count) {
    const CompactList<std::uint32_t> exact(std::vector<std::uint32_t>(count, 1));
    EXPECT_LE(exact.memory_bytes(), 4 * count + 8 + 16) << count;
    CompactList<std::uint32_t> grown;
    for (std::size_t i = 0; i < count; ++i) grown.push_back(1);
    EXPECT_LE(grown.memory_bytes(), 5 * count + 8 + 16) << count;
  }
}

}  // namespace
}  // namespace fanstream
