// What holds for every model and every order in which its segments arrive.
#include <gtest/gtest.h>

#include <map>

#include "tests/support/asset_helpers.h"
#include "tests/support/cleaned_shared_mesh.h"
#include "tests/support/ring_views.h"

namespace fanstream {
namespace {

using testing::build_and_open;
using testing::face_keys;
using testing::fully_refined;
using testing::image_of;
using testing::is_manifold;
using testing::on_grid;
using testing::OpenAsset;
using testing::SeededRandom;
using testing::start;
using testing::StateImage;

const std::vector<std::pair<std::string, TriangleMesh>>& shapes() {
  static const auto all = testing::model_shapes();
  return all;
}

class Streaming : public ::testing::TestWithParam<std::size_t> {
 protected:
  static const std::pair<std::string, TriangleMesh>& shape() { return shapes()[GetParam()]; }
  // Built once per shape.
  static const OpenAsset& asset() {
    static std::map<std::size_t, OpenAsset> assets;
    const auto found = assets.find(GetParam());
    if (found != assets.end()) return found->second;
    return assets.emplace(GetParam(), build_and_open(shape().second)).first->second;
  }
};

TEST_P(Streaming, FullRefinementIsTheQuantisedInputFaceForFace) {
  ASSERT_TRUE(asset().head);
  const auto mesh = fully_refined(asset());
  EXPECT_EQ(mesh->vertex_count(), shape().second.positions.size());
  EXPECT_EQ(face_keys(mesh->triangle_mesh()), face_keys(on_grid(shape().second, asset().head->grid)));
  std::string why;
  EXPECT_TRUE(is_manifold(*mesh, &why)) << why;
  EXPECT_EQ(mesh->complete_generation(), asset().head->generation_count());
}

// Whatever is held: a vertex that is to be split again is known on its generation's lattice, any other exactly.
TEST_P(Streaming, WhatIsKnownOfAPlaceFollowsFromItsContext) {
  ASSERT_TRUE(asset().head);
  const auto full = fully_refined(asset());
  std::uint32_t coarse = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const auto mesh = start(asset());
    for (const auto& [cell, segment] : asset().segments()) {
      if (random.one_in(3)) continue;
      ASSERT_TRUE(mesh->add_segment(cell, segment, asset().segment(cell, segment)));
    }
    ASSERT_TRUE(mesh->refine());
    if (random.one_in(2)) mesh->coarsen_to(random.below(asset().head->generation_count() + 1));
    const FanState& state = mesh->state();
    for (VertexId v = 0; v < state.vertices.size(); ++v) {
      if (!state.fans.contains(v)) continue;
      const FanVertex& vertex = state.vertices[v];
      ASSERT_EQ(vertex.place, state.precision.shown(vertex.place, vertex.context)) << "vertex " << v;
      if (vertex.context.next != kNeverSplit) {
        coarse += state.precision.lattice(vertex.context.touched).is_exact() ? 0 : 1;
      } else {
        ASSERT_EQ(vertex.place, full->state().vertices[v].place) << "vertex " << v;
      }
    }
  }
  EXPECT_EQ(coarse == 0, asset().head->precision.is_exact());
}

TEST(StreamingShapes, MostAreCoarserAtCoarseGenerations) {
  std::size_t coarse = 0;
  for (const auto& [name, mesh] : shapes()) {
    const OpenAsset asset = build_and_open(mesh);
    ASSERT_TRUE(asset.head) << name;
    coarse += asset.head->precision.is_exact() ? 0 : 1;
  }
  EXPECT_GE(2 * coarse, shapes().size());
}

TEST_P(Streaming, BuildingTwiceGivesTheSameBytes) {
  ASSERT_TRUE(asset().head);
  EXPECT_EQ(build_and_open(shape().second).bytes, asset().bytes);
}

TEST_P(Streaming, ArrivalOrderNeverMatters) {
  ASSERT_TRUE(asset().head);
  const StateImage expected = image_of(*fully_refined(asset()));
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    auto order = asset().segments();
    random.shuffle(order);
    const auto mesh = start(asset());
    for (const auto& [cell, segment] : order) {
      ASSERT_TRUE(mesh->add_segment(cell, segment, asset().segment(cell, segment)));
      if (!random.one_in(6)) continue;
      const bool in_depth = random.one_in(2);
      const auto refined = in_depth ? mesh->refine() : mesh->refine(random.below(asset().head->vertex_count));
      ASSERT_TRUE(refined) << refined.error().message;
      std::string why;
      ASSERT_TRUE(is_manifold(*mesh, &why)) << why;
    }
    ASSERT_TRUE(mesh->refine());
    ASSERT_TRUE(mesh->is_complete());
    ASSERT_TRUE(image_of(*mesh) == expected);
  }
}

TEST_P(Streaming, TheSameSegmentsGiveTheSameMesh) {
  ASSERT_TRUE(asset().head);
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    auto held = asset().segments();
    if (held.empty()) return;
    random.shuffle(held);
    held.resize(1 + random.below(held.size()));
    StateImage expected;
    for (int order = 0; order < 3; ++order) {
      const auto mesh = start(asset());
      for (const auto& [cell, segment] : held) {
        ASSERT_TRUE(mesh->add_segment(cell, segment, asset().segment(cell, segment)));
        if (order == 0 || random.one_in(4)) {
          ASSERT_TRUE(mesh->refine());
        } else if (random.one_in(4)) {
          ASSERT_TRUE(mesh->refine(random.below(asset().head->vertex_count)));
        }
        if (order == 2 && random.one_in(5)) {
          mesh->coarsen_to(random.below(asset().head->generation_count() + 1));
          std::string why;
          ASSERT_TRUE(is_manifold(*mesh, &why)) << why;
        }
      }
      ASSERT_TRUE(mesh->refine());
      if (order == 0) expected = image_of(*mesh);
      ASSERT_TRUE(image_of(*mesh) == expected) << "order " << order;
      random.shuffle(held);
    }
  }
}

// Without a limit cells are refined one by one in depth, with one all of them generation by generation.
TEST_P(Streaming, RefiningInDepthGivesWhatRefiningEvenlyGives) {
  ASSERT_TRUE(asset().head);
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    auto held = asset().segments();
    random.shuffle(held);
    if (held.size() > 1) held.resize(held.size() / 2 + random.below(held.size() / 2));
    const auto in_depth = start(asset());
    const auto evenly = start(asset());
    for (const auto& [cell, segment] : held) {
      ASSERT_TRUE(in_depth->add_segment(cell, segment, asset().segment(cell, segment)));
      ASSERT_TRUE(evenly->add_segment(cell, segment, asset().segment(cell, segment)));
    }
    ASSERT_TRUE(in_depth->refine());
    ASSERT_TRUE(evenly->refine(asset().head->vertex_count - 1));
    ASSERT_TRUE(image_of(*in_depth) == image_of(*evenly));
    const auto more = evenly->refine();
    ASSERT_TRUE(more);
    EXPECT_EQ(*more, 0U);
    const TriangleMesh a = in_depth->triangle_mesh();
    const TriangleMesh b = evenly->triangle_mesh();
    ASSERT_TRUE(a.positions == b.positions && a.triangles == b.triangles);
  }
}

TEST_P(Streaming, LimitsAreKeptAndNothingIsLostByThem) {
  ASSERT_TRUE(asset().head);
  std::uint32_t largest_cell = 0;
  for (const CellEntry& cell : asset().index->cells) largest_cell = std::max(largest_cell, cell.split_count);
  const StateImage expected = image_of(*fully_refined(asset()));
  const auto mesh = start(asset());
  for (const auto& [cell, segment] : asset().segments()) {
    ASSERT_TRUE(mesh->add_segment(cell, segment, asset().segment(cell, segment)));
  }
  const std::uint32_t all = asset().head->vertex_count;
  for (std::uint32_t limit = mesh->vertex_count(); limit < all; limit += 1 + all / 7) {
    const std::uint32_t before = mesh->vertex_count();
    const auto refined = mesh->refine(limit);
    ASSERT_TRUE(refined) << refined.error().message;
    EXPECT_EQ(mesh->vertex_count() - before, *refined);
    EXPECT_GE(mesh->vertex_count(), limit);
    EXPECT_LE(mesh->vertex_count(), std::max(before, limit + largest_cell));
    std::string why;
    ASSERT_TRUE(is_manifold(*mesh, &why)) << why;
  }
  ASSERT_TRUE(mesh->refine());
  ASSERT_TRUE(image_of(*mesh) == expected);
}

TEST_P(Streaming, CoarseningAndRefiningGiveTheSameStateAtEveryLayer) {
  ASSERT_TRUE(asset().head);
  const auto mesh = fully_refined(asset());
  const StateImage full = image_of(*mesh);
  const StateImage base = image_of(*start(asset()));
  std::vector<std::uint32_t> borders{0};
  for (const std::uint8_t end : asset().head->layer_ends) borders.push_back(end);
  for (const std::uint32_t border : borders) {
    SCOPED_TRACE("generation " + std::to_string(border));
    const std::uint32_t before = mesh->vertex_count();
    const std::uint64_t undone = mesh->coarsen_to(border);
    EXPECT_EQ(undone, before - mesh->vertex_count());
    EXPECT_EQ(mesh->complete_generation(), border);
    std::string why;
    ASSERT_TRUE(is_manifold(*mesh, &why)) << why;
    // The same as a mesh that never had more.
    const auto coarse = start(asset());
    for (const auto& [cell, segment] : asset().segments()) {
      const CellEntry& entry = asset().index->cells[cell];
      const std::uint32_t layer = asset().head->layer_begin(entry.slab) + segment;
      if (asset().head->layer_ends[layer] > border) continue;
      ASSERT_TRUE(coarse->add_segment(cell, segment, asset().segment(cell, segment)));
    }
    ASSERT_TRUE(coarse->refine());
    coarse->coarsen_to(border);  // segments without bytes are there from the start
    ASSERT_TRUE(image_of(*mesh) == image_of(*coarse));
    if (border == 0) {
      ASSERT_TRUE(image_of(*mesh) == base);
    }
    const auto refined = mesh->refine();
    ASSERT_TRUE(refined) << refined.error().message;
    EXPECT_EQ(*refined, undone);
    ASSERT_TRUE(image_of(*mesh) == full);
  }
}

TEST_P(Streaming, CoarseningBetweenLayersStopsAtTheOneBelow) {
  ASSERT_TRUE(asset().head);
  const auto mesh = fully_refined(asset());
  for (std::uint32_t generation = asset().head->generation_count() + 1; generation-- > 0;) {
    std::uint32_t border = 0;
    for (const std::uint8_t end : asset().head->layer_ends) {
      if (end <= generation) border = end;
    }
    mesh->coarsen_to(generation);
    ASSERT_EQ(mesh->complete_generation(), border) << "generation " << generation;
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, Streaming, ::testing::Range<std::size_t>(0, shapes().size()),
                         [](const auto& parameter) {
                           std::string name = shapes()[parameter.param].first;
                           for (char& c : name) c = c == ' ' ? '_' : c;
                           return name;
                         });

class SharedMeshStreaming : public ::testing::TestWithParam<const char*> {};

TEST_P(SharedMeshStreaming, ComesBackFaceForFaceInAnyOrder) {
  const auto mesh = testing::cleaned_shared_mesh(GetParam());
  if (!mesh) GTEST_SKIP() << GetParam() << " is not there (../shared/data)";
  BuildOptions options;
  options.position_bits = 12;
  const OpenAsset asset = build_and_open(*mesh, options);
  ASSERT_TRUE(asset.head);
  const auto expected = face_keys(on_grid(*mesh, asset.head->grid));
  const auto whole = fully_refined(asset);
  ASSERT_TRUE(face_keys(whole->triangle_mesh()) == expected);
  const StateImage full = image_of(*whole);

  SeededRandom random(77);
  auto order = asset.segments();
  random.shuffle(order);
  const auto streamed = start(asset);
  for (std::size_t i = 0; i < order.size(); ++i) {
    ASSERT_TRUE(streamed->add_segment(order[i].first, order[i].second, asset.segment(order[i].first, order[i].second)));
    if (i % (order.size() / 4 + 1) != 0) continue;
    const auto refined = streamed->refine();
    ASSERT_TRUE(refined) << refined.error().message;
    std::string why;
    ASSERT_TRUE(is_manifold(*streamed, &why)) << why;
  }
  ASSERT_TRUE(streamed->refine());
  ASSERT_TRUE(image_of(*streamed) == full);

  streamed->coarsen_to(asset.head->generation_count() / 2);
  std::string why;
  ASSERT_TRUE(is_manifold(*streamed, &why)) << why;
  ASSERT_TRUE(streamed->refine());
  ASSERT_TRUE(image_of(*streamed) == full);
  streamed->coarsen_to(0);
  EXPECT_EQ(face_keys(streamed->triangle_mesh()), face_keys(start(asset)->triangle_mesh()));
}

INSTANTIATE_TEST_SUITE_P(Real, SharedMeshStreaming,
                         ::testing::Values("stanford_bunny_zipper.ply", "fandisk_13k.obj",
                                           "dragon_stanford_48k_nonmanifold.ply"),
                         [](const auto& parameter) {
                           const std::string file = parameter.param;
                           return file.substr(0, file.find('.'));
                         });

}  // namespace
}  // namespace fanstream
