#include "tests/bench/forced_share.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "tests/bench/asset_replay.h"
#include "tests/support/mesh_generators.h"
#include "tests/unit/bench/built_asset.h"

namespace fanstream::bench {
namespace {

// Every split with the ring and the places that it was decoded against.
struct Log {
  struct Entry {
    VertexId root = 0;
    std::vector<VertexId> ring;
    std::vector<glm::vec3> spokes;
    VertexId added = 0;
    bool operator==(const Entry&) const = default;
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<Entry>> splits;  // by cell and generation

  void cells_started(std::uint32_t /*slab*/, const std::vector<CellVertices>& /*cells*/, const FanState& /*state*/) {}
  void before_split(std::uint32_t cell, std::uint32_t generation, VertexId root, const RingGeometry& ring) {
    Entry entry;
    entry.root = root;
    for (std::uint32_t i = 0; i < ring.size(); ++i) {
      entry.ring.push_back(ring.id(i));
      entry.spokes.push_back(to_vec3(ring.spoke(i)));
    }
    splits[{cell, generation}].push_back(std::move(entry));
  }
  // Splits come in batches: several are announced before the first is made.
  void after_split(std::uint32_t cell, std::uint32_t generation, VertexId root, VertexId added) {
    auto& entries = splits[{cell, generation}];
    const auto latest = std::find_if(entries.rbegin(), entries.rend(), [&](const Entry& e) { return e.root == root; });
    latest->added = added;
  }
};

class ForcedShareTest : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const std::string shape = GetParam();
    const TriangleMesh mesh = shape == "torus"    ? testing::make_torus(60, 40)
                              : shape == "sphere" ? testing::make_sphere(40, 60)
                                                  : testing::make_terrain(50, 45, 3);
    asset_ = built_asset(mesh, small_cells());
    ASSERT_TRUE(asset_);
    ASSERT_GT(asset_->cell_count(), 60U);
    ASSERT_GT(asset_->asset_head()->slab_ends.size(), 1U);
    Result<SplitDependencies> dependencies = SplitDependencies::of(asset_);
    ASSERT_TRUE(dependencies) << dependencies.error().message;
    dependencies_ = std::move(*dependencies);
    const std::vector<std::uint32_t> everything(asset_->cell_count(), asset_->asset_head()->generation_count());
    ASSERT_TRUE(replay_asset(*asset_, everything, whole_));
  }

  std::vector<VertexId> random_vertices(std::uint64_t seed, std::size_t count) const {
    std::mt19937_64 random(seed);
    std::vector<VertexId> vertices;
    while (vertices.size() < count) {
      const auto v = static_cast<VertexId>(random() % asset_->vertex_count());
      vertices.push_back(v);
      const VertexId w = dependencies_.full().fans.ring(v)[0];
      if (w != kOutside) vertices.push_back(w);
    }
    return vertices;
  }

  bool in_full(const FanState& state, std::span<const VertexId> vertices) const {
    return std::all_of(vertices.begin(), vertices.end(), [&](VertexId v) {
      const FanState& full = dependencies_.full();
      if (!state.fans.contains(v) || state.fans.ring(v) != full.fans.ring(v)) return false;
      const std::vector<VertexId> ring = full.fans.ring(v);
      return state.vertices[v].place == full.vertices[v].place &&
             std::all_of(ring.begin(), ring.end(), [&](VertexId w) {
               return w == kOutside || state.vertices[w].place == full.vertices[w].place;
             });
    });
  }

  // By brute force: decodes exactly these generations, and sees whether every split is decoded against the surroundings
  // it was coded with, none is missing, and the vertices are there in full.
  bool suffices(std::span<const std::uint32_t> generations, std::span<const std::uint32_t> expected,
                std::span<const VertexId> vertices) const {
    Log log;
    const Result<FanState> state = replay_asset(*asset_, generations, log);
    if (!state || !in_full(*state, vertices)) return false;
    std::size_t wanted = 0;
    for (const auto& [where, entries] : whole_.splits) {
      if (where.second <= expected[where.first]) wanted += entries.size();
    }
    std::size_t found = 0;
    for (const auto& [where, entries] : log.splits) {
      const auto it = whole_.splits.find(where);
      if (it == whole_.splits.end() || it->second != entries) return false;
      found += entries.size();
    }
    return found >= wanted;
  }

  std::shared_ptr<const OpenAsset> asset_;
  SplitDependencies dependencies_;
  Log whole_;
};

TEST_P(ForcedShareTest, WhatIsNeededSufficesByBruteForce) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const auto vertices = random_vertices(seed, seed % 3 + 1);
    const auto needed = dependencies_.needed(vertices);
    EXPECT_TRUE(suffices(needed, needed, vertices));
  }
}

TEST_P(ForcedShareTest, NothingOfWhatIsNeededCanBeLeftOut) {
  const auto vertices = random_vertices(77, 1);
  const auto needed = dependencies_.needed(vertices);
  std::uint32_t tried = 0;
  for (std::uint32_t c = 0; c < needed.size(); ++c) {
    if (needed[c] == 0) continue;
    auto less = needed;
    --less[c];
    // A generation without splits can be left out unnoticed, unless children wait for it.
    const bool has_splits = whole_.splits.count({c, needed[c]}) != 0;
    if (!has_splits && asset_->asset_index()->cells[c].child_count == 0) continue;
    ++tried;
    EXPECT_FALSE(suffices(less, needed, vertices)) << "cell " << c << " generation " << needed[c];
  }
  EXPECT_GT(tried, 5U);
}

TEST_P(ForcedShareTest, AClientWithTheSegmentsThatAreNeededHasTheVerticesInFull) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const auto vertices = random_vertices(seed, 1);
    const auto needed = dependencies_.needed(vertices);
    ProgressiveMesh mesh(asset_->asset_head());
    mesh.set_index(asset_->asset_index());
    for (std::uint32_t c = 0; c < needed.size(); ++c) {
      const std::uint32_t first = asset_->asset_head()->layer_begin(asset_->asset_index()->cells[c].slab);
      for (std::uint32_t s = 0; s < asset_->segment_count(c); ++s) {
        if (needed[c] < asset_->asset_head()->first_generation(first + s)) continue;
        ASSERT_TRUE(mesh.add_segment(c, s, asset_->segment(c, s)));
      }
    }
    ASSERT_TRUE(mesh.refine());
    EXPECT_TRUE(in_full(mesh.state(), vertices));
    EXPECT_EQ(mesh.is_complete(), dependencies_.byte_share(needed) == 1.0);
  }
}

TEST_P(ForcedShareTest, SharesGrowWithTheDiscUpToEverything) {
  const ForcedShare small = forced_share(dependencies_, 0.01, 4);
  const ForcedShare large = forced_share(dependencies_, 0.3, 4);
  const ForcedShare whole = forced_share(dependencies_, 1.0, 1);
  EXPECT_GE(small.splits, 0.005);
  EXPECT_LT(small.splits, large.splits);
  EXPECT_LT(small.bytes, large.bytes);
  EXPECT_LE(large.splits, 1.0);
  EXPECT_DOUBLE_EQ(whole.splits, 1.0);
  EXPECT_DOUBLE_EQ(whole.bytes, 1.0);
  EXPECT_EQ(forced_share(dependencies_, 0.01, 4).splits, small.splits);
}

INSTANTIATE_TEST_SUITE_P(Shapes, ForcedShareTest, ::testing::Values("torus", "sphere", "terrain"),
                         [](const auto& shape) { return std::string(shape.param); });

}  // namespace
}  // namespace fanstream::bench
