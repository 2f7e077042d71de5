// What holds for every model when cells are refined and coarsened on their own, in whatever order.
#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <set>

#include "common/mesh/mesh_hash.h"
#include "tests/support/cleaned_shared_mesh.h"
#include "tests/support/closed_sets.h"
#include "tests/support/exact_bytes.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/progressive_checks.h"

namespace fanstream {
namespace {

using testing::bounds_hold;
using testing::build_and_open;
using testing::ClosedSets;
using testing::ExactBytes;
using testing::fully_refined;
using testing::is_largest_mesh;
using testing::is_manifold;
using testing::OpenAsset;
using testing::refined_image_of;
using testing::SeededRandom;
using testing::start;
using testing::topology_of;

using Targets = std::vector<std::uint32_t>;                        // by cell
using Places = std::set<std::pair<std::uint32_t, std::uint32_t>>;  // cells and segments

std::unique_ptr<ProgressiveMesh> start_following(const OpenAsset& asset) {
  auto mesh = std::make_unique<ProgressiveMesh>(asset.head, MeshMemory::live_part);
  mesh->set_index(asset.index);
  return mesh;
}

void add(ProgressiveMesh& mesh, const OpenAsset& asset, std::pair<std::uint32_t, std::uint32_t> place) {
  const auto added = mesh.add_segment(place.first, place.second, asset.segment(place.first, place.second));
  ASSERT_TRUE(added) << added.error().message;
}

// A mesh that has done nothing but go where it should.
std::unique_ptr<ProgressiveMesh> gone_straight(const OpenAsset& asset, const Places& held, const Targets& targets) {
  auto mesh = start(asset);
  for (const auto& place : held) add(*mesh, asset, place);
  std::vector<CellTarget> all;
  for (std::uint32_t c = 0; c < targets.size(); ++c) all.push_back({c, targets[c]});
  const MeshMove move = mesh->move_to(all);
  EXPECT_TRUE(move.finished);
  EXPECT_TRUE(move.damage.empty());
  EXPECT_EQ(move.undone, 0U);
  return mesh;
}

// Cells around a random one at full detail, all others the coarser the less they have to do with it; or anything.
std::vector<CellTarget> random_targets(const ProgressiveMesh& mesh, SeededRandom& random) {
  const auto cells = static_cast<std::uint32_t>(mesh.index().cells.size());
  std::vector<CellTarget> targets;
  const std::uint32_t kind = random.below(5);
  if (kind == 0) {  // few
    for (std::uint32_t i = 0, n = 1 + random.below(6); i < n; ++i) {
      targets.push_back({random.below(cells), random.below(12)});
    }
    return targets;
  }
  const auto middle = static_cast<double>(random.below(cells));
  const std::uint32_t deepest = random.below(mesh.head().layer_ends.size() + 1);
  for (std::uint32_t c = 0; c < cells; ++c) {
    const CellEntry& entry = mesh.index().cells[c];
    const std::uint32_t first = mesh.head().layer_begin(entry.slab);
    std::uint32_t wanted = kind == 1 ? random.below(entry.segment_count + 2U) : deepest > first ? deepest - first : 0;
    if (kind == 2) wanted = std::abs(c - middle) < cells / 6.0 ? ProgressiveMesh::kEverySegment : wanted;
    if (kind == 3 && random.one_in(3)) wanted = 0;
    targets.push_back({c, wanted});
  }
  random.shuffle(targets);
  return targets;
}

// A mesh under random treatment, and what it should be.
class Wanderer {
 public:
  Wanderer(const OpenAsset& asset, const ClosedSets& closed_sets, std::uint64_t seed)
      : asset_(asset),
        closed_sets_(closed_sets),
        random_(seed),
        mesh_(start_following(asset)),
        targets_(asset.index->cells.size(), ProgressiveMesh::kEverySegment) {
    for (const auto& place : asset.segments()) missing_.push_back(place);
    random_.shuffle(missing_);
    if (random_.one_in(3)) std::sort(missing_.rbegin(), missing_.rend());  // in order
  }

  ProgressiveMesh& mesh() { return *mesh_; }

  void take_a_step() {
    switch (random_.below(8)) {
      case 0: return receive(1 + random_.below(1 + missing_.size() / 2));
      case 1: return release();
      case 2: return go_back();
      case 3: return refine();
      default: return move(random_targets(*mesh_, random_), random_.one_in(4));
    }
  }
  void receive_all() { receive(missing_.size()); }

  void expect_as_gone_straight() {
    (void)mesh_->move_to({});
    ASSERT_TRUE(is_largest_mesh(*mesh_));
    ASSERT_TRUE(bounds_hold(*mesh_));
    std::string why;
    ASSERT_TRUE(is_manifold(*mesh_, &why)) << why;
    expect_largest_closed_set();
    const auto straight = gone_straight(asset_, held_, targets_);
    ASSERT_TRUE(refined_image_of(*mesh_) == refined_image_of(*straight));
    ASSERT_EQ(mesh_->vertex_count(), straight->vertex_count());
    ASSERT_EQ(mesh_hash(mesh_->triangle_mesh()), mesh_hash(straight->triangle_mesh()));
  }

 private:
  void receive(std::size_t count) {
    for (std::size_t i = 0; i < count && !missing_.empty(); ++i) {
      add(*mesh_, asset_, missing_.back());
      held_.insert(missing_.back());
      missing_.pop_back();
    }
  }

  void release() {
    const auto cell = static_cast<std::uint32_t>(random_.below(targets_.size()));
    const std::uint32_t keep = random_.below(asset_.index->cells[cell].segment_count + 1U);
    std::size_t freed = mesh_->release_segments(cell, keep);
    for (std::uint32_t s = 0; s < asset_.index->cells[cell].segment_count; ++s) {
      if (!held_.contains({cell, s}) || mesh_->holds(cell, s)) continue;
      ASSERT_GE(s, keep);
      freed -= asset_.segment(cell, s).size();
      held_.erase({cell, s});
      missing_.emplace_back(cell, s);
    }
    ASSERT_EQ(freed, 0U);
    random_.shuffle(missing_);
  }

  void move(const std::vector<CellTarget>& targets, bool in_steps) {
    for (const CellTarget& t : targets) targets_[t.cell] = t.segments;
    const std::uint32_t before = mesh_->vertex_count();
    const MeshMove moved = mesh_->move_to(targets, in_steps ? 1 + random_.below(200) : ProgressiveMesh::kNoBudget);
    ASSERT_EQ(mesh_->vertex_count(), before + moved.applied - moved.undone);
    ASSERT_TRUE(moved.damage.empty());
    ASSERT_TRUE(in_steps || moved.finished);
    std::string why;
    ASSERT_TRUE(is_manifold(*mesh_, &why)) << why;
    if (!in_steps || random_.one_in(2)) return;
    for (bool finished = moved.finished; !finished;) {
      const MeshMove more = mesh_->move_to({}, 50);
      ASSERT_TRUE(more.finished || more.applied + more.undone >= 50);
      finished = more.finished;
    }
    ASSERT_TRUE(is_largest_mesh(*mesh_));
  }

  void go_back() {
    const std::uint32_t before = mesh_->vertex_count();
    const std::uint64_t undone = mesh_->coarsen_to(random_.below(asset_.head->generation_count() + 1U));
    ASSERT_EQ(mesh_->vertex_count() + undone, before);
  }

  void refine() {
    std::fill(targets_.begin(), targets_.end(), ProgressiveMesh::kEverySegment);
    const std::uint32_t limit = random_.one_in(2) ? kMostVertices : random_.below(asset_.head->vertex_count);
    const auto refined = mesh_->refine(limit);
    ASSERT_TRUE(refined) << refined.error().message;
  }

  // Against what the splits were coded with, not what the mesh says of itself.
  void expect_largest_closed_set() {
    Targets prefixes(targets_.size(), 0);
    for (std::uint32_t c = 0; c < prefixes.size(); ++c) {
      const std::uint32_t most = std::min<std::uint32_t>(targets_[c], asset_.index->cells[c].segment_count);
      while (prefixes[c] < most && (asset_.segment(c, prefixes[c]).empty() || held_.contains({c, prefixes[c]}))) {
        ++prefixes[c];
      }
    }
    const std::vector<std::uint32_t> expected = closed_sets_.largest(prefixes);
    for (std::uint32_t c = 0; c < prefixes.size(); ++c) {
      ASSERT_EQ(mesh_->applied_generation(c), expected[c]) << "cell " << c;
    }
    ASSERT_EQ(mesh_->vertex_count(), closed_sets_.vertex_count(expected));
  }

  const OpenAsset& asset_;
  const ClosedSets& closed_sets_;
  SeededRandom random_;
  std::unique_ptr<ProgressiveMesh> mesh_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> missing_;
  Places held_;
  Targets targets_;
};

void expect_any_route_gives_one_mesh(const OpenAsset& asset, std::uint64_t seeds, int steps, int check_every) {
  ASSERT_TRUE(asset.head);
  if (asset.index->cells.empty()) return;
  const auto topology = topology_of(fully_refined(asset)->triangle_mesh());
  const auto base = refined_image_of(*start(asset));
  const ClosedSets closed_sets(asset);
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Wanderer wanderer(asset, closed_sets, seed);
    for (int step = 1; step <= steps; ++step) {
      SCOPED_TRACE("step " + std::to_string(step));
      wanderer.take_a_step();
      if (::testing::Test::HasFatalFailure()) return;
      if (step % check_every != 0) continue;
      wanderer.expect_as_gone_straight();
      if (::testing::Test::HasFatalFailure()) return;
      ASSERT_TRUE(topology_of(wanderer.mesh().triangle_mesh()) == topology);
    }
    wanderer.mesh().set_all_targets(0);
    const MeshMove move = wanderer.mesh().move_to({});
    ASSERT_EQ(move.applied, 0U);
    ASSERT_TRUE(refined_image_of(wanderer.mesh()) == base) << "coarsening all gives FM0";
    ASSERT_LE(wanderer.mesh().vertex_count(), asset.head->base.places.size());
    wanderer.receive_all();
    ASSERT_TRUE(wanderer.mesh().refine());
    ASSERT_TRUE(wanderer.mesh().is_complete());
  }
}

// Small cells, with a layer for each generation or with several generations to a layer.
BuildOptions cells_with_layers(bool single_generations) {
  BuildOptions options = testing::small_cells();
  if (single_generations) options.segment_splits = 0.5;
  return options;
}

const std::vector<std::pair<std::string, TriangleMesh>>& shapes() {
  static const auto all = testing::model_shapes();
  return all;
}

class ViewDependent : public ::testing::TestWithParam<std::tuple<std::size_t, bool>> {
 protected:
  // Built once per shape and kind of layers.
  static const OpenAsset& asset() {
    static std::map<std::tuple<std::size_t, bool>, OpenAsset> assets;
    const auto found = assets.find(GetParam());
    if (found != assets.end()) return found->second;
    const auto [shape, single] = GetParam();
    return assets.emplace(GetParam(), build_and_open(shapes()[shape].second, cells_with_layers(single))).first->second;
  }
};

TEST_P(ViewDependent, AnyRouteGivesOneMesh) { expect_any_route_gives_one_mesh(asset(), 5, 60, 3); }

// Whatever a planner has read of a cell is still right if the cell is not named as changed.
TEST_P(ViewDependent, CellsThatChangeAreNamed) {
  ASSERT_TRUE(asset().head);
  const auto cells = static_cast<std::uint32_t>(asset().index->cells.size());
  if (cells == 0) return;
  struct Seen {
    bool live = false;
    std::uint32_t applied = 0, prefix = 0, held = 0;
    std::vector<std::uint32_t> neighbours;
    glm::dvec3 centre{0.0};
    double radius = 0.0;
    glm::vec3 axis{0.0F};
    float cosine = 0.0F;
    bool operator==(const Seen&) const = default;
  };
  const auto look_at = [](const ProgressiveMesh& mesh, std::uint32_t c) {
    Seen seen{mesh.is_live(c), mesh.applied_generation(c), mesh.applied_prefix(c), mesh.held_prefix(c), {}};
    if (!seen.live) return seen;
    seen.neighbours.assign(mesh.neighbours(c).begin(), mesh.neighbours(c).end());
    std::sort(seen.neighbours.begin(), seen.neighbours.end());
    CellVertices vertices;  // as the state knows them
    vertices.cell = c;
    for (const VertexId v : mesh.vertices_in_order()) {
      if (mesh.state().cells[v] == c) vertices.initial.push_back(v);
    }
    BoundsScratch scratch;
    const CellBounds bounds = cell_bounds(mesh.state(), vertices, mesh.head().grid, scratch);
    seen.centre = bounds.centre;
    seen.radius = bounds.radius;
    seen.axis = bounds.cone_axis;
    seen.cosine = bounds.cone_cosine;
    EXPECT_EQ(bounds.centre, mesh.bounds(c).centre);
    EXPECT_EQ(bounds.radius, mesh.bounds(c).radius);
    EXPECT_EQ(bounds.cone_cosine, mesh.bounds(c).cone_cosine);
    return seen;
  };
  const ClosedSets closed_sets(asset());
  Wanderer wanderer(asset(), closed_sets, 11);
  std::vector<Seen> seen(cells);
  for (int step = 0; step < 25; ++step) {
    SCOPED_TRACE("step " + std::to_string(step));
    const std::vector<std::uint32_t> changed = wanderer.mesh().take_changed_cells();
    ASSERT_EQ(std::set(changed.begin(), changed.end()).size(), changed.size()) << "each once";
    std::vector<bool> named(cells);
    for (const std::uint32_t c : changed) named[c] = true;
    for (std::uint32_t c = 0; c < cells; ++c) {
      Seen now = look_at(wanderer.mesh(), c);
      ASSERT_TRUE(named[c] || (step > 0 ? now == seen[c] : now == Seen{}) || (step == 0 && now.held != 0))
          << "cell " << c;
      seen[c] = std::move(now);
    }
    wanderer.take_a_step();
    if (HasFatalFailure()) return;
  }
}

std::string shape_name(const ::testing::TestParamInfo<std::tuple<std::size_t, bool>>& parameter) {
  const auto [shape, single] = parameter.param;
  std::string name = shapes()[shape].first + (single ? " single" : " joined");
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Shapes, ViewDependent,
                         ::testing::Combine(::testing::Range<std::size_t>(0, shapes().size()), ::testing::Bool()),
                         shape_name);

class SharedMeshViewDependent : public ::testing::TestWithParam<const char*> {};

TEST_P(SharedMeshViewDependent, AnyRouteGivesOneMesh) {
  const auto mesh = testing::cleaned_shared_mesh(GetParam());
  if (!mesh) GTEST_SKIP() << GetParam() << " is not there (../shared/data)";
  BuildOptions options;
  options.position_bits = 12;
  options.segment_splits = 20.0;
  expect_any_route_gives_one_mesh(build_and_open(*mesh, options), 2, 24, 6);
}

INSTANTIATE_TEST_SUITE_P(Real, SharedMeshViewDependent,
                         ::testing::Values("stanford_bunny_zipper.ply", "fandisk_13k.obj", "cow_2904v.off",
                                           "mountain_terrain_51k_open.ply"),
                         [](const auto& parameter) {
                           const std::string file = parameter.param;
                           return file.substr(0, file.find('.'));
                         });

// --- Damage ---

const OpenAsset& terrain() {
  static const OpenAsset built = build_and_open(testing::make_terrain(24, 22, 3));
  return built;
}

// A damaged segment stops its cell, and what depends on it; all else goes on, and nothing is lost.
TEST(ViewDependentDamage, CostsTheMeshNoMoreThanTheSegment) {
  ASSERT_TRUE(terrain().head);
  SeededRandom random(9);
  const auto base = refined_image_of(*start(terrain()));
  std::size_t noticed = 0;
  std::size_t tried = 0;
  for (const auto& [cell, segment] : terrain().segments()) {
    for (int flip = 0; flip < 6; ++flip) {
      ExactBytes bytes(terrain().segment(cell, segment));
      const std::uint32_t bit = random.below(bytes.view().size() * 8);
      SCOPED_TRACE("cell " + std::to_string(cell) + ", segment " + std::to_string(segment) + ", bit " +
                   std::to_string(bit));
      bytes.flip(bit);
      const OpenAsset& asset = terrain();
      const auto mesh = start_following(asset);
      mesh->set_all_targets(0);
      for (const auto& place : asset.segments()) {
        const bool bad = place == std::pair{cell, segment};
        ASSERT_TRUE(mesh->add_segment(place.first, place.second,
                                      bad ? bytes.view() : asset.segment(place.first, place.second)));
      }
      mesh->set_all_targets(ProgressiveMesh::kEverySegment);
      std::vector<MeshMove::Damage> damage;
      for (bool finished = false; !finished;) {
        MeshMove move = mesh->move_to({}, 1 + random.below(300));
        damage.insert(damage.end(), move.damage.begin(), move.damage.end());
        finished = move.finished;
        std::string why;
        ASSERT_TRUE(is_manifold(*mesh, &why)) << why;
      }
      ++tried;
      noticed += damage.empty() ? 0 : 1;
      std::vector<std::uint32_t> damaged;
      for (const MeshMove::Damage& d : damage) {
        EXPECT_NE(d.error.message.find("cell " + std::to_string(d.cell)), std::string::npos) << d.error.message;
        damaged.push_back(d.cell);
      }
      ASSERT_TRUE(is_largest_mesh(*mesh, damaged));
      ASSERT_TRUE(mesh->move_to({}).damage.empty()) << "told once";
      // The same as if what could not be decoded had never come, as far as the damage was noticed where it is.
      if (damage.size() == 1 && damage[0].cell == cell && damage[0].segment == segment) {
        Places held;
        for (const auto& place : terrain().segments()) {
          if (place.first != cell || place.second < segment) held.insert(place);
        }
        const auto without =
            gone_straight(terrain(), held, Targets(terrain().index->cells.size(), ProgressiveMesh::kEverySegment));
        const bool stops_before = mesh->applied_prefix(cell) == segment &&
                                  mesh->applied_generation(cell) == without->applied_generation(cell);
        if (stops_before) {
          ASSERT_TRUE(refined_image_of(*mesh) == refined_image_of(*without));
        }
      }
      mesh->set_all_targets(0);
      (void)mesh->move_to({});
      ASSERT_TRUE(refined_image_of(*mesh) == base);
      for (const std::uint32_t c : damaged) EXPECT_GT(mesh->release_segments(c, 0), 0U);
    }
  }
  std::printf("[  figures ] %zu of %zu flipped bits were noticed\n", noticed, tried);
  EXPECT_GT(noticed * 4, tried * 3);
}

TEST(ViewDependentDamage, ManySegmentsOfNoiseLeaveAMeshThatGoesBackToFM0) {
  ASSERT_TRUE(terrain().head);
  const auto base = refined_image_of(*start(terrain()));
  for (std::uint64_t seed = 0; seed < 150; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const OpenAsset& asset = terrain();
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::byte>> noise;
    for (const auto& place : asset.segments()) {
      if (!random.one_in(8)) continue;
      std::vector<std::byte>& bytes = noise[place];
      bytes.resize(terrain().segment(place.first, place.second).size());
      for (std::byte& b : bytes) b = static_cast<std::byte>(random.below(256));
    }
    const auto mesh = start_following(asset);
    for (const auto& place : asset.segments()) {
      const auto found = noise.find(place);
      ASSERT_TRUE(mesh->add_segment(
          place.first, place.second,
          found == noise.end() ? asset.segment(place.first, place.second) : std::span<const std::byte>(found->second)));
    }
    for (int move = 0; move < 8; ++move) {
      (void)mesh->move_to(random_targets(*mesh, random), random.one_in(2) ? 100 : ProgressiveMesh::kNoBudget);
      std::string why;
      ASSERT_TRUE(is_manifold(*mesh, &why)) << why;
      ASSERT_TRUE(bounds_hold(*mesh));
    }
    mesh->set_all_targets(0);
    (void)mesh->move_to({});
    ASSERT_TRUE(refined_image_of(*mesh) == base);
  }
}

}  // namespace
}  // namespace fanstream
