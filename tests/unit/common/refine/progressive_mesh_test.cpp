#include "common/refine/progressive_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "tests/support/mesh_generators.h"
#include "tests/support/progressive_checks.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::build_and_open;
using testing::fully_refined;
using testing::is_largest_mesh;
using testing::OpenAsset;
using testing::refined_image_of;

const OpenAsset& sphere() {
  static const OpenAsset built = build_and_open(testing::make_sphere(60, 70));
  return built;
}

// All segments held, nothing wanted yet.
std::unique_ptr<ProgressiveMesh> waiting(const OpenAsset& asset, MeshMemory memory = MeshMemory::live_part) {
  auto mesh = std::make_unique<ProgressiveMesh>(asset.head, memory);
  mesh->set_index(asset.index);
  mesh->set_all_targets(0);
  for (const auto& [cell, segment] : asset.segments()) {
    EXPECT_TRUE(mesh->add_segment(cell, segment, asset.segment(cell, segment)));
  }
  return mesh;
}

// A cell of the finest slab with its ancestors, coarsest first.
std::vector<std::uint32_t> line_of(const OpenAsset& asset, std::uint32_t cell) {
  std::vector<std::uint32_t> line{cell};
  while (asset.index->cells[line.back()].slab > 0) line.push_back(asset.index->cells[line.back()].parent);
  return {line.rbegin(), line.rend()};
}

TEST(ProgressiveMesh, ATargetAloneMovesNothingThatDependsOnOthers) {
  const auto mesh = waiting(sphere());
  const auto last = static_cast<std::uint32_t>(sphere().index->cells.size() - 1);
  const MeshMove child_alone = mesh->move_to(std::array{CellTarget{last, ProgressiveMesh::kEverySegment}});
  EXPECT_EQ(child_alone.applied, 0U);
  EXPECT_TRUE(child_alone.finished);
  EXPECT_FALSE(mesh->is_live(last));
  EXPECT_EQ(mesh->applied_generation(last), 0U);
}

// A cell goes no further than those beside it allow, and pulls nothing along that is not wanted.
TEST(ProgressiveMesh, ACellWaitsForTheCellsBesideIt) {
  std::uint64_t applied = 0;  // one cell may have no roots in the generations that it gets through alone
  for (std::uint32_t cell = 0; cell < sphere().head->root_cell_count; ++cell) {
    SCOPED_TRACE("cell " + std::to_string(cell));
    const auto mesh = waiting(sphere());
    const MeshMove move = mesh->move_to(std::array{CellTarget{cell, ProgressiveMesh::kEverySegment}});
    applied += move.applied;
    EXPECT_LT(mesh->applied_generation(cell), sphere().head->layer_ends[sphere().head->slab_ends[0] - 1]);
    EXPECT_EQ(mesh->vertex_count(), sphere().head->base.places.size() + move.applied);
    for (std::uint32_t c = 0; c < sphere().head->root_cell_count; ++c) {
      if (c == cell) continue;
      EXPECT_EQ(mesh->applied_generation(c), 0U);
    }
    EXPECT_TRUE(is_largest_mesh(*mesh));
  }
  EXPECT_GT(applied, 0U);
}

TEST(ProgressiveMesh, CoarseningACellTakesWhatDependsOnItAndNoMore) {
  const auto mesh = waiting(sphere());
  mesh->set_all_targets(ProgressiveMesh::kEverySegment);
  (void)mesh->move_to({});
  ASSERT_TRUE(mesh->is_complete());
  const auto full = refined_image_of(*mesh);
  (void)mesh->take_changed_cells();
  const auto cell = static_cast<std::uint32_t>(sphere().index->cells.size()) - 1;
  ASSERT_TRUE(mesh->is_live(cell));
  const std::vector<std::uint32_t> line = line_of(sphere(), cell);
  ASSERT_GT(line.size(), 1U);

  // The last segment of one cell: its neighbours are at most a generation finer, so few others change.
  const std::uint32_t segments = sphere().index->cells[cell].segment_count;
  const MeshMove back = mesh->move_to(std::array{CellTarget{cell, segments - 1}});
  EXPECT_EQ(back.applied, 0U);
  EXPECT_GT(back.undone, 0U);
  EXPECT_EQ(mesh->applied_prefix(cell), segments - 1);
  EXPECT_TRUE(is_largest_mesh(*mesh));
  EXPECT_LT(mesh->take_changed_cells().size(), sphere().index->cells.size());

  // Its first ancestor: it goes with all its descendants.
  const MeshMove root = mesh->move_to(std::array{CellTarget{line.front(), 0}});
  EXPECT_GT(root.undone, back.undone);
  EXPECT_TRUE(mesh->is_live(line.front()));
  EXPECT_FALSE(mesh->is_live(cell));
  EXPECT_TRUE(is_largest_mesh(*mesh));

  const MeshMove again = mesh->move_to(std::array{CellTarget{line.front(), ProgressiveMesh::kEverySegment},
                                                  CellTarget{cell, ProgressiveMesh::kEverySegment}});
  EXPECT_EQ(again.applied, back.undone + root.undone);
  EXPECT_TRUE(refined_image_of(*mesh) == full);
}

TEST(ProgressiveMesh, ABudgetIsKeptAndTheRestIsDoneLater) {
  const auto mesh = waiting(sphere());
  std::uint32_t largest = 0;
  for (const CellEntry& cell : sphere().index->cells) largest = std::max(largest, cell.split_count);
  mesh->set_all_targets(ProgressiveMesh::kEverySegment);
  EXPECT_FALSE(mesh->move_to({}, 0).finished);
  for (const bool refining : {true, false}) {
    if (!refining) mesh->set_all_targets(0);
    int calls = 0;
    for (bool finished = false; !finished; ++calls) {
      const MeshMove move = mesh->move_to({}, 100);
      finished = move.finished;
      ASSERT_LT(move.applied + move.undone, 100 + largest);
      ASSERT_TRUE(finished || move.applied + move.undone >= 100);
      ASSERT_TRUE(testing::is_manifold(*mesh, nullptr));
    }
    EXPECT_GT(calls, 5);
    EXPECT_EQ(mesh->is_complete(), refining);
  }
  EXPECT_TRUE(refined_image_of(*mesh) == refined_image_of(*testing::start(sphere())));
}

// A budget may stop a call between what depends on a cell and the cell; if that is then no longer to be coarsened, what
// was undone for it comes back.
TEST(ProgressiveMesh, AChangeOfMindInTheMiddleOfCoarseningIsNoLoss) {
  const auto mesh = waiting(sphere());
  mesh->set_all_targets(ProgressiveMesh::kEverySegment);
  (void)mesh->move_to({});
  const auto full = refined_image_of(*mesh);
  std::uint64_t undone = 0;
  for (std::uint64_t budget = 1; budget < 400; budget = budget * 3 / 2 + 1) {
    undone += mesh->move_to(std::array{CellTarget{0, 0}}, budget).undone;
    (void)mesh->move_to(std::array{CellTarget{0, ProgressiveMesh::kEverySegment}});
    ASSERT_TRUE(refined_image_of(*mesh) == full) << "budget " << budget;
  }
  EXPECT_GT(undone, 400U);
}

TEST(ProgressiveMesh, CellsNamedFirstAreRefinedFirst) {
  const std::uint32_t roots = sphere().head->root_cell_count;
  ASSERT_GT(roots, 3U);
  for (const bool backwards : {false, true}) {
    const auto mesh = waiting(sphere());
    std::vector<CellTarget> targets;
    for (std::uint32_t c = 0; c < roots; ++c) targets.push_back({backwards ? roots - 1 - c : c, 1});
    (void)mesh->move_to(targets, 1);
    EXPECT_GT(mesh->applied_generation(targets.front().cell), 0U);
    EXPECT_EQ(mesh->applied_generation(targets.back().cell), 0U);
  }
}

TEST(ProgressiveMesh, RefineDropsTheTargets) {
  const auto mesh = waiting(sphere());
  (void)mesh->move_to(std::array{CellTarget{0, 1}});
  ASSERT_FALSE(mesh->is_complete());
  const auto refined = mesh->refine();
  ASSERT_TRUE(refined);
  EXPECT_TRUE(mesh->is_complete());
  EXPECT_EQ(mesh->target(0), ProgressiveMesh::kEverySegment);
  EXPECT_TRUE(refined_image_of(*mesh) == refined_image_of(*fully_refined(sphere())));
}

TEST(ProgressiveMesh, SegmentsAreReleasedUnlessTheyAreApplied) {
  const auto mesh = waiting(sphere());
  std::size_t held_bytes = 0;
  for (const auto& [cell, segment] : sphere().segments()) held_bytes += sphere().segment(cell, segment).size();
  mesh->set_all_targets(ProgressiveMesh::kEverySegment);
  (void)mesh->move_to({});
  for (std::uint32_t c = 0; c < sphere().index->cells.size(); ++c) EXPECT_EQ(mesh->release_segments(c, 0), 0U);
  const std::size_t full_bytes = mesh->memory_bytes();
  mesh->set_all_targets(0);
  (void)mesh->move_to({});
  std::size_t freed = 0;
  for (std::uint32_t c = 0; c < sphere().index->cells.size(); ++c) freed += mesh->release_segments(c, 0);
  EXPECT_EQ(freed, held_bytes);
  EXPECT_FALSE(mesh->holds(0, 0));
  EXPECT_EQ(mesh->held_prefix(0), 0U);
  EXPECT_LT(mesh->memory_bytes() + freed, full_bytes);
  const auto refined = mesh->refine();
  ASSERT_TRUE(refined);
  EXPECT_EQ(*refined, 0U) << "nothing is held any more";
  for (const auto& [cell, segment] : sphere().segments()) {
    ASSERT_TRUE(mesh->add_segment(cell, segment, sphere().segment(cell, segment)));
  }
  ASSERT_TRUE(mesh->refine());
  EXPECT_TRUE(mesh->is_complete());
}

// With a budget of one split, cells take their generations alone. Some segments are noise: the same turn out to be
// damaged, with what is around those that pass for good, and they keep nobody else from going on.
TEST(ProgressiveMesh, CellsSideBySideBecomeWhatTheyDoOneByOne) {
  std::size_t found = 0;
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    testing::SeededRandom random(seed);
    const MeshMemory memory = seed % 2 == 0 ? MeshMemory::live_part : MeshMemory::whole_model;
    const auto together = std::make_unique<ProgressiveMesh>(sphere().head, memory);
    const auto alone = std::make_unique<ProgressiveMesh>(sphere().head, memory);
    for (ProgressiveMesh* mesh : {together.get(), alone.get()}) mesh->set_index(sphere().index);
    std::size_t bad = 0;
    for (const auto& [cell, segment] : sphere().segments()) {
      const std::span<const std::byte> good = sphere().segment(cell, segment);
      std::vector<std::byte> bytes(good.begin(), good.end());
      if (seed > 3 && random.one_in(50)) {
        for (std::byte& b : bytes) b = static_cast<std::byte>(random.below(256));
        ++bad;
      }
      for (ProgressiveMesh* mesh : {together.get(), alone.get()}) {
        ASSERT_TRUE(mesh->add_segment(cell, segment, bytes));
      }
    }
    using Damage = std::pair<std::pair<std::uint32_t, std::uint32_t>, std::string>;
    std::array<std::vector<Damage>, 2> damage;
    std::array<std::uint64_t, 2> applied{};
    for (std::size_t m = 0; m < 2; ++m) {
      ProgressiveMesh& mesh = m == 0 ? *together : *alone;
      for (bool finished = false; !finished;) {
        const MeshMove move = mesh.move_to({}, m == 0 ? ProgressiveMesh::kNoBudget : 1);
        for (const auto& d : move.damage) damage[m].push_back({{d.cell, d.segment}, d.error.message});
        applied[m] += move.applied;
        finished = move.finished;
      }
      std::sort(damage[m].begin(), damage[m].end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    }
    EXPECT_EQ(applied[0], applied[1]);
    EXPECT_EQ(damage[0].size(), damage[1].size());
    EXPECT_TRUE(bad > 0 || damage[0].empty());
    found += damage[0].size();
    for (std::size_t i = 0; i < std::min(damage[0].size(), damage[1].size()); ++i) {
      EXPECT_EQ(damage[0][i].first, damage[1][i].first);
      if (memory == MeshMemory::whole_model) {
        EXPECT_EQ(damage[0][i].second, damage[1][i].second);
      }
    }
    EXPECT_TRUE(testing::image_of(*together) == testing::image_of(*alone));
    EXPECT_EQ(together->is_complete(), damage[0].empty());
  }
  EXPECT_GT(found, 20U);
}

// --- Cell tables that promise less than the vertices tell ---

// Whatever is held and wanted, in one go: what is wrong is said, and by which cell.
void expect_damage_in(const OpenAsset& forged, std::uint32_t cell) {
  const auto mesh = waiting(forged);
  mesh->set_all_targets(ProgressiveMesh::kEverySegment);
  const MeshMove move = mesh->move_to({});
  ASSERT_EQ(move.damage.size(), 1U);
  EXPECT_EQ(move.damage[0].cell, cell);
  EXPECT_NE(move.damage[0].error.message.find("cell " + std::to_string(cell) + ":"), std::string::npos)
      << move.damage[0].error.message;
  EXPECT_TRUE(move.finished);
  EXPECT_FALSE(mesh->is_complete());
  std::string why;
  EXPECT_TRUE(testing::is_manifold(*mesh, &why)) << why;
}

TEST(ProgressiveMesh, ACellThatIsSaidToHaveNoSplitsButHasIsNamed) {
  for (std::uint32_t c = 0; c < sphere().index->cells.size(); c += 7) {
    SCOPED_TRACE(c);
    const CellEntry& entry = sphere().index->cells[c];
    if (entry.split_count == 0) continue;
    auto index = std::make_shared<AssetIndex>(*sphere().index);
    index->cells[c].split_count = 0;
    for (std::uint32_t s = 0; s < entry.segment_count; ++s) index->segments[entry.first_segment + s].size_bytes = 0;
    OpenAsset forged = sphere();
    forged.index = index;
    expect_damage_in(forged, c);
  }
}

TEST(ProgressiveMesh, ACellWithoutChildrenWhoseVerticesAreStillToBeSplitIsNamed) {
  std::size_t tried = 0;
  for (std::uint32_t c = 0; c < sphere().index->cells.size(); ++c) {
    SCOPED_TRACE(c);
    const CellEntry& entry = sphere().index->cells[c];
    std::uint32_t of_children = 0;
    for (std::uint32_t i = 0; i < entry.child_count; ++i) {
      of_children += sphere().index->cells[entry.first_child + i].split_count;
    }
    if (of_children == 0) continue;
    auto index = std::make_shared<AssetIndex>(*sphere().index);
    index->cells[c].child_count = 0;
    OpenAsset forged = sphere();
    forged.index = index;
    expect_damage_in(forged, c);
    ++tried;
  }
  EXPECT_GT(tried, 5U);
}

// The large arrays of a mesh that follows a view come and go with its vertices.
TEST(ProgressiveMesh, MemoryFollowsTheLivePart) {
  const OpenAsset asset = build_and_open(testing::make_terrain(150, 140, 3), BuildOptions{});
  ASSERT_TRUE(asset.head);
  const auto mesh = waiting(asset);
  const std::size_t base = mesh->memory_bytes();
  mesh->set_all_targets(ProgressiveMesh::kEverySegment);
  (void)mesh->move_to({});
  const std::size_t full = mesh->memory_bytes();
  EXPECT_LT(full, std::size_t{160} * asset.head->triangle_count);
  const auto whole = waiting(asset, MeshMemory::whole_model);
  EXPECT_GT(whole->memory_bytes(), 10 * base);
  // One root cell and all that grew from it.
  (void)mesh->move_to(std::array{CellTarget{0, 0}});
  EXPECT_LT(mesh->memory_bytes(), full);
  mesh->set_all_targets(0);
  (void)mesh->move_to({});
  EXPECT_LT(mesh->memory_bytes(), base + 65536) << "of " << full << ", the state " << mesh->state().memory_bytes();
  EXPECT_GT(full, base + 1'000'000);
}

}  // namespace
}  // namespace fanstream
