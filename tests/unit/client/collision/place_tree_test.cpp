#include "client/collision/place_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <set>

#include "tests/support/asset_helpers.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

glm::dvec3 random_point(SeededRandom& random) {
  return 2.0 * glm::dvec3(random.unit(), random.unit(), random.unit()) - 1.0;
}

class Places : public ::testing::Test {
 protected:
  Places()
      : asset_(testing::build_and_open(testing::make_sphere(40, 60))),
        cells_(*asset_.head, *asset_.index),
        tree_(cells_, BoxFrame::of(asset_.head->grid)),
        places_(asset_.index->cells.size(), kNoBounds) {}

  void widen(std::uint32_t cell, const Bounds& box) {
    tree_.widen(cell, box);
    for (std::uint32_t c = cell; c != CellHierarchy::kNone; c = asset_.index->cells[c].parent) {
      places_[c] = united(places_[c], box);
    }
  }
  std::set<std::uint32_t> found(const Focus& focus) const {
    std::set<std::uint32_t> cells;
    tree_.find(FocusTest(focus), [&](std::uint32_t c) {
      const std::uint32_t parent = asset_.index->cells[c].parent;
      EXPECT_TRUE(parent == CellHierarchy::kNone || cells.count(parent) == 1) << "what it comes from was not before it";
      EXPECT_TRUE(cells.insert(c).second);
      return true;
    });
    return cells;
  }
  std::set<std::uint32_t> touched(const Focus& focus) const {
    std::set<std::uint32_t> cells;
    for (std::uint32_t c = 0; c < places_.size(); ++c) {
      if (places_[c].low.x <= places_[c].high.x && FocusTest(focus).may_touch(places_[c])) cells.insert(c);
    }
    return cells;
  }

  testing::OpenAsset asset_;
  CellHierarchy cells_;
  PlaceTree tree_;
  std::vector<Bounds> places_;
};

TEST_F(Places, AllThatAFocusTouchesAreFoundAndLittleMore) {
  SeededRandom random(4);
  std::size_t count = 0;
  for (int round = 0; round < 400; ++round) {
    const glm::dvec3 at = random_point(random);
    const glm::dvec3 size = 0.05 * std::pow(random.unit(), 2) * (random_point(random) + 1.0);
    widen(random.below(places_.size()), {at - size, at + size});
    Focus focus;
    focus.sphere = FocusSphere{3.0 * random_point(random), std::pow(random.unit(), 3) * 2.0};
    if (random.one_in(20)) focus.sphere->centre *= std::pow(10.0, 30.0 * random.unit());
    if (random.one_in(3)) {
      focus.region = [least = random_point(random).x](const Bounds& box) { return box.high.x >= least; };
    }
    const std::set<std::uint32_t> exact = touched(focus);
    const std::set<std::uint32_t> cells = found(focus);
    EXPECT_TRUE(std::includes(cells.begin(), cells.end(), exact.begin(), exact.end())) << "round " << round;
    Focus wider = focus;
    wider.sphere->radius += 0.01 + 1e-5 * glm::length(focus.sphere->centre);
    wider.region = {};
    const std::set<std::uint32_t> most = touched(wider);
    EXPECT_TRUE(std::includes(most.begin(), most.end(), cells.begin(), cells.end())) << "round " << round;
    count += exact.size();
  }
  EXPECT_GT(count, 1000U);
}

TEST_F(Places, NothingIsFoundWhereNothingLies) {
  EXPECT_TRUE(found({.sphere = FocusSphere{{0, 0, 0}, 1e60}}).empty());
  widen(0, {glm::dvec3(-1.0), glm::dvec3(1.0)});
  EXPECT_FALSE(found({.sphere = FocusSphere{{0, 0, 0}, 1e60}}).empty());
  tree_.clear();
  EXPECT_TRUE(found({.sphere = FocusSphere{{0, 0, 0}, 1e60}}).empty());
}

}  // namespace
}  // namespace fanstream
