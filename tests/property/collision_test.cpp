// What holds for every model when parts of it are restored for a focus, wherever that goes, and what collides then.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <set>

#include "client/collision/local_restoration.h"
#include "client/collision/mesh_contacts.h"
#include "client/collision/plane_contacts.h"
#include "common/mesh/mesh_hash.h"
#include "tests/support/cleaned_shared_mesh.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/progressive_checks.h"

namespace fanstream {
namespace {

using testing::build_and_open;
using testing::OpenAsset;
using testing::SeededRandom;

using Corners = std::array<glm::dvec3, 3>;
using Key = std::array<double, 9>;  // of a triangle: the least of its corners in their three orders

Key key_of(const Corners& c) {
  const auto from = [&](std::size_t first) {
    const glm::dvec3& a = c[first];
    const glm::dvec3& b = c[(first + 1) % 3];
    const glm::dvec3& d = c[(first + 2) % 3];
    return Key{a.x, a.y, a.z, b.x, b.y, b.z, d.x, d.y, d.z};
  };
  return std::min({from(0), from(1), from(2)});
}

// A contact as it can be compared: its triangle, and the signed distances or the other triangle.
using ContactKey = std::pair<Key, std::array<double, 3>>;
ContactKey key_of(const PlaneContact& c) {
  std::array<double, 3> distances = c.distances;
  std::sort(distances.begin(), distances.end());
  return {key_of(c.corners), distances};
}
ContactKey key_of(const MeshContact& c) {
  return {key_of(c.corners), {static_cast<double>(c.obstacle_triangle), 0.0, 0.0}};
}

// What a focus covers of these, as a sorted list: equal triangles may be there more than once.
template <class Contacts>
std::vector<ContactKey> covered(const Contacts& contacts, const FocusTest& focus) {
  std::vector<ContactKey> keys;
  for (const auto& c : contacts) {
    if (focus.holds(c.corners)) keys.push_back(key_of(c));
  }
  std::sort(keys.begin(), keys.end());
  return keys;
}

template <class Contacts>
std::vector<ContactKey> originals(const Contacts& contacts, const FocusTest& focus) {
  std::vector<ContactKey> keys;
  for (const auto& c : contacts) {
    if (c.original && focus.holds(c.corners)) keys.push_back(key_of(c));
  }
  std::sort(keys.begin(), keys.end());
  return keys;
}

std::unique_ptr<LocalRestoration> restoration_of(const OpenAsset& asset) {
  auto model = std::make_unique<LocalRestoration>(asset.head, asset.index);
  for (const auto& [cell, segment] : asset.segments()) {
    EXPECT_TRUE(model->add_segment(cell, segment, asset.segment(cell, segment)));
  }
  return model;
}

glm::dvec3 random_point(const Bounds& box, SeededRandom& random) {
  const glm::dvec3 share(random.unit(), random.unit(), random.unit());
  return box.low + (box.high - box.low) * (1.4 * share - 0.2);
}

glm::dvec3 random_direction(SeededRandom& random) {
  return glm::normalize(glm::dvec3(random.unit(), random.unit(), random.unit()) - 0.5 + glm::dvec3(1e-3));
}

Focus random_focus(const Bounds& box, SeededRandom& random) {
  Focus focus;
  const std::uint32_t kind = random.below(8);
  if (kind != 0)
    focus.sphere = FocusSphere{random_point(box, random), box.diagonal() * 0.4 * std::pow(random.unit(), 2)};
  if (kind <= 2) focus.facing = FocusFacing{random_direction(random), 180.0 * std::pow(random.unit(), 2)};
  if (kind == 7) return {};
  return focus;
}

Plane random_plane(const Bounds& box, SeededRandom& random) {
  const glm::dvec3 normal = random_direction(random);
  const glm::dvec3 at = random_point(box, random);
  return make_plane(normal.x, normal.y, normal.z, -glm::dot(normal, at)).value();
}

// One that vertices lie on, or far away, or in general position.
Plane random_plane(const TriangleMesh& mesh, const Bounds& box, SeededRandom& random) {
  const Triangle& t = mesh.triangles[random.below(mesh.triangles.size())];
  const glm::dvec3& a = mesh.positions[t[0]];
  switch (random.below(5)) {
    case 0: {  // along the grid, through all vertices of one coordinate
      Plane plane{{0.0, 0.0, 0.0}, 0.0};
      const int axis = static_cast<int>(random.below(3));
      plane.normal[axis] = random.one_in(2) ? 1.0 : -1.0;
      plane.offset = -plane.normal[axis] * a[axis];
      return plane;
    }
    case 1: {  // through a triangle, to rounding
      const glm::dvec3 normal = glm::cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
      const Result<Plane> plane = make_plane(normal.x, normal.y, normal.z, -glm::dot(normal, a));
      if (plane) return *plane;
      return random_plane(box, random);
    }
    case 2: {
      Plane plane = random_plane(box, random);
      plane.offset += (random.unit() - 0.5) * box.diagonal() * std::pow(10.0, 40.0 * random.unit() - 2.0);
      return plane;
    }
    default: return random_plane(box, random);
  }
}

// A model in full, and what has to hold of it restored in part.
class Model {
 public:
  explicit Model(OpenAsset asset) : asset_(std::move(asset)) {
    if (!asset_.head) return;
    full_ = testing::fully_refined(asset_)->triangle_mesh();
    patch_ = patch_of(full_);
    box_ = bounds_of(full_.positions);
    for (std::size_t t = 0; t < patch_.triangles.size(); ++t) keys_.push_back(key_of(patch_.corners(t)));
    std::sort(keys_.begin(), keys_.end());
  }

  const OpenAsset& asset() const { return asset_; }
  const TriangleMesh& full() const { return full_; }
  const Bounds& box() const { return box_; }
  const SurfacePatch& patch() const { return patch_; }

  // Every triangle in focus is there, what is marked as original is so, and nothing is there twice or missing.
  void expect_covered(const LocalRestoration& model, const FocusTest& focus) const {
    std::vector<Key> there;
    std::vector<Key> marked;
    model.surface().visit([](const Bounds&) { return true; },
                          [&](const LiveTriangle& t) {
                            there.push_back(key_of(t.corners));
                            if (t.original) marked.push_back(there.back());
                          });
    std::sort(there.begin(), there.end());
    std::sort(marked.begin(), marked.end());
    ASSERT_EQ(mesh_hash(model.surface().triangle_mesh()), mesh_hash(model.mesh().triangle_mesh()));
    ASSERT_EQ(there.size(), model.surface().triangle_count());
    ASSERT_TRUE(std::includes(keys_.begin(), keys_.end(), marked.begin(), marked.end())) << "marked, but not original";
    std::vector<Key> in_focus;
    for (std::size_t t = 0; t < patch_.triangles.size(); ++t) {
      if (focus.holds(patch_.corners(t))) in_focus.push_back(key_of(patch_.corners(t)));
    }
    std::sort(in_focus.begin(), in_focus.end());
    ASSERT_TRUE(std::includes(marked.begin(), marked.end(), in_focus.begin(), in_focus.end())) << "not covered";
  }

  void expect_same_contacts(const LocalRestoration& model, const FocusTest& focus, const Plane& plane) const {
    PlaneContacts in_full;
    PlaneContacts restored;
    PlaneContacts one_by_one;
    find_contacts(patch_, plane, in_full);
    find_contacts(model.surface(), plane, restored);
    find_contacts(patch_of(model.surface().triangle_mesh()), plane, one_by_one);
    // As the caller keeps them: the second search finds what the first has left behind.
    restored.clear();
    find_contacts(model.surface(), plane, restored);
    ASSERT_EQ(originals(restored.contacts, focus), covered(in_full.contacts, focus));
    // The tree leaves out nothing of the restored mesh.
    ASSERT_EQ(restored.touching, one_by_one.touching);
    ASSERT_EQ(restored.behind, one_by_one.behind);
    ASSERT_EQ(restored.least_distance, one_by_one.least_distance);
    ASSERT_EQ(restored.contacts.size(), restored.touching);
    ASSERT_EQ(plane.distance(restored.least_at), restored.least_distance);
    ASSERT_LE(restored.tested_triangles, model.surface().triangle_count());
  }

  // Asked about the focus alone, the restored mesh answers as the full model would.
  void expect_same_within(const LocalRestoration& model, const FocusTest& focus, const Plane& plane) const {
    PlaneContacts expected;
    for (std::size_t t = 0; t < patch_.triangles.size(); ++t) {
      if (!focus.holds(patch_.corners(t))) continue;
      const std::array<glm::dvec3, 3> c = patch_.corners(t);
      find_contacts(patch_of({{c[0], c[1], c[2]}, {{0, 1, 2}}}), plane, expected);
    }
    PlaneContacts found;
    find_contacts(model.surface(), plane, found, {.within = &focus});
    ASSERT_EQ(originals(found.contacts, focus), covered(expected.contacts, focus));
    ASSERT_EQ(found.contacts.size(), expected.contacts.size());
    ASSERT_EQ(found.touching, expected.touching);
    ASSERT_EQ(found.touching_original, expected.touching);
    ASSERT_EQ(found.behind, expected.behind);
    ASSERT_EQ(found.least_distance, expected.least_distance);
  }

  void expect_same_contacts(const LocalRestoration& model, const FocusTest& focus, const MeshObstacle& obstacle) const {
    const MeshContacts in_full = find_contacts(patch_, obstacle);
    const MeshContacts restored = find_contacts(model.surface(), obstacle);
    ASSERT_TRUE(in_full.all_found && restored.all_found);
    ASSERT_EQ(originals(restored.contacts, focus), covered(in_full.contacts, focus));
    const MeshContacts one_by_one = find_contacts(patch_of(model.surface().triangle_mesh()), obstacle);
    ASSERT_EQ(restored.touching_pairs, one_by_one.touching_pairs);
  }

 private:
  OpenAsset asset_;
  TriangleMesh full_;
  SurfacePatch patch_;
  Bounds box_;
  std::vector<Key> keys_;
};

TriangleMesh small_obstacle(const Bounds& box, SeededRandom& random) {
  TriangleMesh mesh;
  const double size = box.diagonal() * (0.02 + 0.1 * random.unit());
  testing::append(mesh, testing::make_sphere(9, 11, size), random_point(box, random));
  for (glm::dvec3& p : mesh.positions) p += 1e-3 * size * glm::dvec3(random.unit(), random.unit(), random.unit());
  return mesh;
}

// With other meshes only if asked for: far away from 0 FCL's volumes are rounded by more than what they hold.
void walk(const Model& full, std::uint64_t seeds, int steps, bool measured, bool meshes = true) {
  ASSERT_TRUE(full.asset().head);
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const auto model = restoration_of(full.asset());
    if (measured) {
      ASSERT_TRUE(model->measure());
    }
    for (int step = 0; step < steps; ++step) {
      SCOPED_TRACE("step " + std::to_string(step));
      if (random.one_in(4)) {
        model->set_coarseness(random.one_in(4) ? 0.0 : full.box().diagonal() * 0.1 * std::pow(random.unit(), 3));
      }
      const Plane plane = random_plane(full.box(), random);
      Focus focus = random_focus(full.box(), random);
      if (random.one_in(4)) focus.region = region_of(std::vector{plane});
      const RestorationMove move = model->move(focus);
      ASSERT_TRUE(move.covered);
      ASSERT_TRUE(model->missing().empty());
      const FocusTest test(focus);
      full.expect_covered(*model, test);
      full.expect_same_contacts(*model, test, plane);
      for (int k = 0; k < 3; ++k) {
        const Plane other = random_plane(full.full(), full.box(), random);
        full.expect_same_contacts(*model, test, other);
        full.expect_same_within(*model, test, other);
      }
      if (meshes && random.one_in(3)) {
        full.expect_same_contacts(*model, test, MeshObstacle::create(small_obstacle(full.box(), random)).value());
      }
      std::string why;
      ASSERT_TRUE(testing::is_manifold(model->mesh(), &why)) << why;
      if (::testing::Test::HasFatalFailure()) return;
    }
  }
}

const std::vector<std::pair<std::string, TriangleMesh>>& shapes() {
  static const auto all = testing::model_shapes();
  return all;
}

class Collision : public ::testing::TestWithParam<std::size_t> {
 protected:
  static const Model& model() {
    static std::map<std::size_t, Model> models;
    const auto found = models.find(GetParam());
    if (found != models.end()) return found->second;
    return models.emplace(GetParam(), Model(build_and_open(shapes()[GetParam()].second))).first->second;
  }
};

TEST_P(Collision, ContactsInTheFocusAreThoseOfTheFullModel) { walk(model(), 4, 25, true); }
TEST_P(Collision, TheyAreSoBeforeTheModelIsMeasured) { walk(model(), 4, 25, false); }

// What boxes are rounded by does not depend on where the model lies, and how large it is; positions are.
TEST(FarAway, ContactsInTheFocusAreThoseOfTheFullModel) {
  for (const auto& [scale, offset] : {std::pair{1e-3, 1e5}, {1e-9, 1e5}, {1e-15, 0.5}, {1e30, 1e32}, {1e-60, 0.0}}) {
    SCOPED_TRACE("scale " + std::to_string(scale) + " offset " + std::to_string(offset));
    TriangleMesh mesh = testing::make_sphere(30, 40);
    for (glm::dvec3& p : mesh.positions) p = scale * p + offset * glm::dvec3(1.0, -0.7, 0.3);
    const Model model(build_and_open(mesh));
    walk(model, 2, 12, true, false);
    walk(model, 2, 6, false, false);
  }
}

// A path leaves no traces, once it is known where cells lie.
TEST_P(Collision, AnyPathOfTheFocusLeadsToOneMesh) {
  ASSERT_TRUE(model().asset().head);
  SeededRandom random(5);
  const auto walker = restoration_of(model().asset());
  ASSERT_TRUE(walker->measure());
  for (int step = 0; step < 20; ++step) {
    SCOPED_TRACE("step " + std::to_string(step));
    const double coarseness = model().box().diagonal() * 0.05 * random.unit();
    walker->set_coarseness(coarseness);
    const Focus focus = random_focus(model().box(), random);
    walker->move(focus);
    const auto straight = restoration_of(model().asset());
    ASSERT_TRUE(straight->measure());
    straight->set_coarseness(coarseness);
    straight->move(focus);
    ASSERT_EQ(mesh_hash(walker->mesh().triangle_mesh()), mesh_hash(straight->mesh().triangle_mesh()));
    const RestorationMove still = walker->move(focus);
    ASSERT_EQ(still.applied + still.undone, 0U);
  }
}

// All that planes cut, and nothing else, has to be fetched for contacts that are those of the full model.
TEST_P(Collision, WhatIsMissingIsNamedUntilContactsAreExact) {
  ASSERT_TRUE(model().asset().head);
  const OpenAsset& asset = model().asset();
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    LocalRestoration local(asset.head, asset.index);
    const Plane plane = random_plane(model().box(), random);
    Focus focus;
    focus.region = region_of(std::vector{plane});
    for (int round = 0;; ++round) {
      ASSERT_LT(round, 200);
      const RestorationMove move = local.move(focus);
      const std::vector<CellTarget> missing = local.missing();
      ASSERT_EQ(move.covered, missing.empty());
      if (missing.empty()) break;
      for (const CellTarget& m : missing) {
        ASSERT_GT(m.segments, local.mesh().held_prefix(m.cell));
        for (std::uint32_t s = 0; s < m.segments; ++s) {
          ASSERT_TRUE(local.add_segment(m.cell, s, asset.segment(m.cell, s)));
        }
      }
    }
    PlaneContacts in_full;
    PlaneContacts restored;
    find_contacts(model().patch(), plane, in_full);
    find_contacts(local.surface(), plane, restored);
    const FocusTest everywhere(Focus{.region = [](const Bounds&) { return true; }});
    ASSERT_EQ(originals(restored.contacts, everywhere), covered(in_full.contacts, everywhere));
    ASSERT_EQ(restored.touching, in_full.touching) << "nor is anything simplified among them";
  }
}

// Cells that are wanted, and what they need, and no more.
TEST_P(Collision, AWantedMeshIsTheSmallest) {
  ASSERT_TRUE(model().asset().head);
  const OpenAsset& asset = model().asset();
  const auto cells = static_cast<std::uint32_t>(asset.index->cells.size());
  if (cells == 0) return;
  SeededRandom random(3);
  ProgressiveMesh mesh(asset.head, MeshMemory::live_part);
  mesh.set_index(asset.index);
  mesh.set_target_meaning(TargetMeaning::wanted);
  mesh.set_all_targets(0);
  for (const auto& [cell, segment] : asset.segments()) {
    ASSERT_TRUE(mesh.add_segment(cell, segment, asset.segment(cell, segment)));
  }
  std::vector<std::uint32_t> wanted(cells, 0);
  for (int step = 0; step < 12; ++step) {
    SCOPED_TRACE("step " + std::to_string(step));
    std::vector<CellTarget> targets;
    for (std::uint32_t i = 0; i < 6; ++i) {
      const std::uint32_t c = random.below(cells);
      wanted[c] = random.one_in(2) ? 0 : random.below(asset.index->cells[c].segment_count + 1U);
      targets.push_back({c, wanted[c]});
    }
    ASSERT_TRUE(mesh.move_to(targets).finished);
    ASSERT_TRUE(testing::bounds_hold(mesh));
    std::vector<std::uint32_t> begun(cells);
    for (std::uint32_t c = 0; c < cells; ++c) {
      begun[c] = mesh.begun_prefix(c);
      if (!mesh.is_live(c)) continue;
      ASSERT_GE(mesh.applied_prefix(c), std::min(wanted[c], asset.index->cells[c].segment_count));
    }
    // Without any one segment that is not wanted, something else is not there either.
    for (std::uint32_t c = 0; c < cells; ++c) {
      if (begun[c] <= wanted[c] || !mesh.is_live(c)) continue;
      if (asset.segment(c, begun[c] - 1).empty()) continue;  // cannot be left out
      auto less = testing::start(asset);
      for (const auto& [cell, segment] : asset.segments()) {
        if (segment >= begun[cell] || (cell == c && segment + 1 >= begun[cell])) continue;
        ASSERT_TRUE(less->add_segment(cell, segment, asset.segment(cell, segment)));
      }
      ASSERT_TRUE(less->refine());
      bool any_less = false;
      for (std::uint32_t other = 0; other < cells; ++other) {
        any_less |= other != c && less->applied_generation(other) < mesh.applied_generation(other);
      }
      ASSERT_TRUE(any_less) << "cell " << c << " was refined for nobody, to generation " << mesh.applied_generation(c)
                            << ", segment " << begun[c] << " where " << wanted[c] << " were wanted";
    }
  }
}

std::string shape_name(const ::testing::TestParamInfo<std::size_t>& parameter) {
  std::string name = shapes()[parameter.param].first;
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Shapes, Collision, ::testing::Range<std::size_t>(0, shapes().size()), shape_name);

class SharedMeshCollision : public ::testing::TestWithParam<const char*> {};

TEST_P(SharedMeshCollision, ContactsInTheFocusAreThoseOfTheFullModel) {
  const auto mesh = testing::cleaned_shared_mesh(GetParam());
  if (!mesh) GTEST_SKIP() << GetParam() << " is not there (../shared/data)";
  const Model model(build_and_open(*mesh, {}));
  walk(model, 1, 8, true);
  walk(model, 1, 4, false);
}

INSTANTIATE_TEST_SUITE_P(Real, SharedMeshCollision,
                         ::testing::Values("stanford_bunny_zipper.ply", "fandisk_13k.obj", "cow_2904v.off",
                                           "mountain_terrain_51k_open.ply"),
                         [](const auto& parameter) {
                           const std::string file = parameter.param;
                           return file.substr(0, file.find('.'));
                         });

}  // namespace
}  // namespace fanstream
