#include "server/build/cell_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "tests/support/random_directions.h"

namespace fanstream {
namespace {

using testing::random_direction;
using testing::SeededRandom;

// A direction on the rim of a cone, or anywhere for one that holds everything.
glm::dvec3 on_rim(const NormalCone& cone, SeededRandom& random) {
  if (!(cone.cosine > -1.0F)) return random_direction(random);
  return testing::direction_on_rim(glm::dvec3(cone.axis), static_cast<double>(cone.cosine), random);
}

// Three slabs of one, three and nine cells, with two, one and three layers.
struct Tree {
  static constexpr std::array<std::uint32_t, 3> kLayers{2, 1, 3};
  std::vector<CellEntry> cells;
  SurfaceErrors surface;
  std::vector<std::vector<std::uint32_t>> patches;  // by cell: all that its splits belong to

  Tree() {
    std::uint32_t child = 1;
    for (std::uint32_t slab = 0; slab < 3; ++slab) {
      const std::uint32_t count = slab == 0 ? 1 : slab == 1 ? 3 : 9;
      for (std::uint32_t i = 0; i < count; ++i) {
        CellEntry cell;
        cell.slab = slab;
        cell.first_child = child;
        cell.child_count = slab < 2 ? 3 : 0;
        child += cell.child_count;
        cells.push_back(cell);
      }
    }
    patches.resize(cells.size());
  }

  // Splits of patches that look roughly where `about` says, or anywhere; some cells have none.
  CellSurface fill(SeededRandom& random, const glm::dvec3& about, double spread) {
    for (std::uint32_t p = 0; p < 60; ++p) {
      PatchSurface patch;
      patch.error = 0.001F * static_cast<float>(random.below(1000));
      patch.normals.axis = glm::vec3(glm::normalize(about + spread * random_direction(random)));
      patch.normals.cosine =
          random.one_in(40) && spread > 0.9 ? -1.0F : static_cast<float>(std::cos(0.3 * random.unit()));
      surface.patches.push_back(patch);
      for (std::uint32_t m = 1 + random.below(3); m > 0; --m) surface.patch_of.push_back(p);
    }
    CellSurface result;
    for (std::uint32_t c = 0; c < cells.size(); ++c) {
      const bool any = !random.one_in(5);
      for (std::uint32_t layer = 0; layer < kLayers[cells[c].slab]; ++layer) {
        for (std::uint32_t i = any ? random.below(6) : 0; i > 0; --i) {
          const std::uint32_t merge = random.below(surface.patch_of.size());
          result.add(c, merge);
          patches[c].push_back(surface.patch_of[merge]);
        }
        result.end_layer(c);
      }
    }
    result.finish(surface, cells);
    return result;
  }
};

TEST(CellSurface, NothingFinerIsFurtherOff) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    Tree tree;
    const CellSurface surface = tree.fill(random, {0, 0, 1}, 0.5);
    for (std::uint32_t c = 0; c < tree.cells.size(); ++c) {
      const CellEntry& cell = tree.cells[c];
      const std::uint32_t layers = Tree::kLayers[cell.slab];
      float largest = 0.0F;
      for (const std::uint32_t p : tree.patches[c]) largest = std::max(largest, tree.surface.patches[p].error);
      EXPECT_GE(surface.error(c, 0), largest);
      for (std::uint32_t s = 1; s < layers; ++s) EXPECT_LE(surface.error(c, s), surface.error(c, s - 1));
      for (std::uint32_t child = cell.first_child; child < cell.first_child + cell.child_count; ++child) {
        EXPECT_LE(surface.error(child, 0), surface.error(c, layers - 1));
      }
      if (cell.child_count == 0) {
        EXPECT_EQ(surface.error(c, 0), largest) << "and no more than it has to";
      }
    }
  }
}

// A cell stands for all that is to come of it: what its splits have merged and what its children's have.
TEST(CellSurface, ConesHoldThoseOfTheCellsPatchesAndOfAllBelow) {
  std::size_t narrow = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    Tree tree;
    const CellSurface surface = tree.fill(random, random_direction(random), 0.05 + random.unit());
    for (std::uint32_t c = static_cast<std::uint32_t>(tree.cells.size()); c-- > 0;) {
      const CellEntry& cell = tree.cells[c];
      for (std::uint32_t child = cell.first_child; child < cell.first_child + cell.child_count; ++child) {
        tree.patches[c].insert(tree.patches[c].end(), tree.patches[child].begin(), tree.patches[child].end());
      }
      const CodedCone cone = surface.cone(c);
      narrow += cone.width != 0 ? 1 : 0;
      for (const std::uint32_t p : tree.patches[c]) {
        const NormalCone& normals = tree.surface.patches[p].normals;
        ASSERT_TRUE(cone.holds(glm::dvec3(normals.axis))) << "cell " << c;
        for (int i = 0; i < 8; ++i) ASSERT_TRUE(cone.holds(on_rim(normals, random))) << "cell " << c;
      }
    }
  }
  EXPECT_GT(narrow, 100U);
}

TEST(CellSurface, WithoutSplitsNothingIsOffAndItLooksAnywhere) {
  Tree tree;
  CellSurface surface;
  for (std::uint32_t c = 0; c < tree.cells.size(); ++c) {
    for (std::uint32_t layer = 0; layer < Tree::kLayers[tree.cells[c].slab]; ++layer) surface.end_layer(c);
  }
  surface.finish(tree.surface, tree.cells);
  for (std::uint32_t c = 0; c < tree.cells.size(); ++c) {
    EXPECT_EQ(surface.error(c, 0), 0.0F);
    EXPECT_EQ(surface.cone(c), CodedCone{});
  }
}

}  // namespace
}  // namespace fanstream
