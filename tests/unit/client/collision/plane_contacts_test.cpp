#include "client/collision/plane_contacts.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

PlaneContacts contacts_of(const TriangleMesh& mesh, const Plane& plane, const PlaneQuery& query = {}) {
  PlaneContacts found;
  find_contacts(patch_of(mesh), plane, found, query);
  return found;
}

TEST(Plane, IsNormalisedWhateverItsLength) {
  for (const double scale : {1.0, 1e-200, 1e200}) {
    const Result<Plane> plane = make_plane(0.0, 3.0 * scale, 4.0 * scale, 10.0 * scale);
    ASSERT_TRUE(plane);
    EXPECT_NEAR(plane->normal.y, 0.6, 1e-15);
    EXPECT_NEAR(plane->normal.z, 0.8, 1e-15);
    EXPECT_NEAR(plane->offset, 2.0, 1e-15);
  }
}

TEST(Plane, WithoutANormalOrNotFiniteIsRefused) {
  for (const auto& [a, d] : {std::pair{0.0, 1.0}, {NAN, 1.0}, {1.0, INFINITY}, {1e-300, 1e300}}) {
    const Result<Plane> plane = make_plane(a, 0.0, 0.0, d);
    ASSERT_FALSE(plane) << a << ' ' << d;
    EXPECT_EQ(plane.error().kind, ErrorKind::usage);
  }
}

// A triangle in each position there is: corners before (+), on (0) and behind (-).
TEST(PlaneContacts, TouchingBehindAndBeforeAreToldApart) {
  struct Case {
    std::array<double, 3> heights;
    std::uint64_t touching, behind;
  };
  for (const Case& c : {Case{{1, 2, 3}, 0, 0}, Case{{-1, -2, -3}, 0, 1}, Case{{-1, 2, 3}, 1, 0}, Case{{0, 2, 3}, 1, 0},
                        Case{{0, 0, -3}, 1, 0}, Case{{0, 0, 0}, 1, 0}, Case{{-1, 0, 1}, 1, 0}}) {
    const TriangleMesh mesh{{{0, 0, c.heights[0]}, {1, 0, c.heights[1]}, {0, 1, c.heights[2]}}, {{0, 1, 2}}};
    const PlaneContacts found = contacts_of(mesh, {{0, 0, 1}, 0.0});
    EXPECT_EQ(found.touching, c.touching);
    EXPECT_EQ(found.behind, c.behind);
    EXPECT_EQ(found.collides(), c.touching + c.behind > 0);
    EXPECT_EQ(found.least_distance, std::min({c.heights[0], c.heights[1], c.heights[2]}));
    if (c.touching == 0) continue;
    ASSERT_EQ(found.contacts.size(), 1U);
    EXPECT_EQ(found.contacts[0].distances, c.heights);
    EXPECT_EQ(found.contacts[0].depth(), std::max(0.0, -found.least_distance));
    EXPECT_TRUE(found.contacts[0].original);
  }
}

TEST(PlaneContacts, ASphereIsCutInARing) {
  const TriangleMesh sphere = testing::make_sphere(40, 60);
  const PlaneContacts found = contacts_of(sphere, {{0, 0, 1}, -0.30001});
  std::uint64_t touching = 0;
  std::uint64_t behind = 0;
  for (const Triangle& t : sphere.triangles) {
    int below = 0;
    for (const VertexId v : t) below += sphere.positions[v].z < 0.30001 ? 1 : 0;
    touching += below == 1 || below == 2 ? 1 : 0;
    behind += below == 3 ? 1 : 0;
  }
  EXPECT_EQ(found.touching, touching);
  EXPECT_EQ(found.behind, behind);
  EXPECT_GT(touching, 0U);
  EXPECT_NEAR(found.least_distance, -1.30001, 1e-12);
}

TEST(PlaneContacts, NoMoreAreListedThanAskedForButAllAreCounted) {
  const TriangleMesh sphere = testing::make_sphere(20, 30);
  const Plane plane{{0, 0, 1}, 0.01};
  const PlaneContacts all = contacts_of(sphere, plane);
  const PlaneContacts few = contacts_of(sphere, plane, {.most_listed = 3});
  EXPECT_EQ(few.contacts.size(), 3U);
  EXPECT_EQ(few.touching, all.touching);
  EXPECT_EQ(all.contacts.size(), all.touching);
  EXPECT_TRUE(std::isinf(contacts_of(sphere, plane, {.least_distance = false}).least_distance));
}

TEST(PlaneContacts, OfSeveralPlanesAddUp) {
  const TriangleMesh sphere = testing::make_sphere(20, 30);
  PlaneContacts both;
  for (const double offset : {0.1, -0.7}) find_contacts(patch_of(sphere), {{0, 0, 1}, offset}, both);
  EXPECT_EQ(both.touching,
            contacts_of(sphere, {{0, 0, 1}, 0.1}).touching + contacts_of(sphere, {{0, 0, 1}, -0.7}).touching);
  EXPECT_NEAR(both.least_distance, -1.7, 1e-12);
  both.clear();
  EXPECT_EQ(both.touching + both.behind + both.tested_triangles, 0U);
  EXPECT_FALSE(both.collides());
}

}  // namespace
}  // namespace fanstream
