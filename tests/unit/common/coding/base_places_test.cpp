#include "common/coding/base_places.h"

#include <gtest/gtest.h>

#include "tests/support/exact_bytes.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::ExactBytes;
using testing::SeededRandom;

struct RandomPlaces {
  PlaceLattice lattice;
  std::vector<GridPoint> codes;   // as they are shown
  std::vector<GridPoint> points;  // of the lattice
  std::vector<std::uint8_t> exact;

  explicit RandomPlaces(SeededRandom& random) {
    const PositionGrid grid = PositionGrid::fit({{0, 0, 0}, {1, 1, 1}}, 14);
    const PlacePrecision precision(std::vector<std::uint8_t>{static_cast<std::uint8_t>(1 + random.below(12))}, grid);
    lattice = precision.lattice(0);
    const std::uint32_t one_in = 1 + random.below(40);
    for (std::uint32_t i = 1 + random.below(300); i > 0; --i) {
      const GridPoint code(random.between(0, 16383), random.between(0, 16383), random.between(0, 16383));
      exact.push_back(random.one_in(one_in) ? 1 : 0);
      points.push_back(lattice.point_of(code));
      codes.push_back(exact.back() != 0 ? code : lattice.code_of(points.back()));
    }
  }
};

TEST(BasePlaces, ExactVerticesComeBackAndTheOthersOnTheirLattice) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    RandomPlaces places(random);
    const ExactBytes bytes(encode_exact_places(places.codes, places.exact, places.lattice));
    const auto exact = decode_exact_places(bytes.view(), places.lattice, places.points);
    ASSERT_TRUE(exact) << exact.error().message;
    EXPECT_EQ(*exact, places.exact);
    EXPECT_EQ(places.points, places.codes);
  }
}

TEST(BasePlaces, WhereNoVertexIsExactThereAreNoBytes) {
  SeededRandom random(3);
  RandomPlaces places(random);
  std::fill(places.exact.begin(), places.exact.end(), 0);
  EXPECT_TRUE(encode_exact_places(places.codes, places.exact, places.lattice).empty());
}

TEST(BasePlaces, DamageIsAnErrorOrOtherPlaces) {
  std::size_t refused = 0;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    RandomPlaces places(random);
    std::vector<std::byte> coded = encode_exact_places(places.codes, places.exact, places.lattice);
    if (coded.empty()) continue;
    coded.resize(1 + random.below(coded.size()));
    coded[random.below(coded.size())] ^= static_cast<std::byte>(1 + random.below(255));
    const ExactBytes bytes(coded);
    const auto exact = decode_exact_places(bytes.view(), places.lattice, places.points);
    if (!exact) {
      EXPECT_EQ(exact.error().message, "damaged exact places");
      ++refused;
    }
  }
  EXPECT_GT(refused, 100U);
}

}  // namespace
}  // namespace fanstream
