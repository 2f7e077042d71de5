#include "server/build/merge_valences.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <stdexcept>
#include <utility>

#include "common/fans/fan_cover.h"
#include "server/build/asset_builder.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool is_inside(const RingMesh& rings, VertexId v) { return rings.position_in_ring(v, kOutside) == rings.ring_size(v); }

int odd_vertices(const RingMesh& rings) {
  int odd = 0;
  for (VertexId v = 0; v < rings.vertex_capacity(); ++v) {
    odd += rings.contains(v) && rings.ring_size(v) % 2 != 0 ? 1 : 0;
  }
  return odd;
}

double square_off(const RingMesh& rings, VertexId v, double usual) {
  const double off = static_cast<double>(rings.ring_size(v)) - usual;
  return off * off;
}

TEST(MergeValences, TellWhatTheMergeLeaves) {
  std::size_t all = 0;
  for (const auto& [name, mesh] : testing::model_shapes()) {
    SCOPED_TRACE(name);
    const RingMesh rings = RingMesh::from_triangles(mesh.positions.size(), mesh.triangles);
    std::size_t inside = 0;
    for (VertexId root = 0; root < mesh.positions.size() && inside < 400; ++root) {
      for (const VertexId removed : rings.ring(root)) {
        if (removed == kOutside || !rings.can_merge(root, removed)) continue;
        MergedRing ring;
        ring.assign(rings, root, removed);
        ring.assign_places(mesh.positions);
        const MergeValences valences = valences_after(ring, rings, root, removed);
        ASSERT_GE(valences.odd, 0);
        ASSERT_LE(valences.odd, 6);
        const RingMesh::Wings wings = rings.wings(root, removed);
        if (wings.first == kOutside || wings.last == kOutside) continue;
        RingMesh merged = rings;
        merged.merge(root, removed);
        const double wings_off = square_off(merged, wings.first, 6.0) + square_off(merged, wings.last, 6.0);
        const double usual = is_inside(merged, root) ? 6.0 : 5.0;  // four and the outside
        ASSERT_EQ(valences.irregularity, square_off(merged, root, usual) + wings_off) << root << " and " << removed;
        if (usual == 5.0) continue;
        ASSERT_EQ(valences.odd, odd_vertices(merged) - odd_vertices(rings) + 4) << root << " and " << removed;
        ++inside;
      }
    }
    all += inside;
  }
  EXPECT_GT(all, 1000U);
}

TEST(MergeValences, DecideWhoGoesFirstNotWhoGoes) {
  constexpr double kOwn = 2.0;
  constexpr double kCost = 3.0;
  for (const double parity : {0.0, 0.3, 1.0}) {
    for (const double limit : {3.5, 10.0, kInfinity}) {
      double last = kCost;
      for (int worse = 0; worse <= 6; ++worse) {
        const double cost = cost_with_valences(kOwn, kCost, limit, {4.0 * worse, worse}, parity);
        EXPECT_GE(cost, last);
        EXPECT_LE(cost, limit);
        last = cost;
      }
      EXPECT_GT(last, kCost);
      EXPECT_EQ(cost_with_valences(kOwn, kCost, limit, {}, parity), kCost);
    }
    EXPECT_EQ(cost_with_valences(kOwn, kCost, 2.5, {9.0, 6}, parity), kCost);  // beyond the limit as it is
    const double scaled = cost_with_valences(1e9 * kOwn, 1e9 * kCost, 1e10, {7.0, 3}, parity);
    EXPECT_NEAR(scaled, 1e9 * cost_with_valences(kOwn, kCost, 10.0, {7.0, 3}, parity), 1.0);
  }
  EXPECT_EQ(cost_with_valences(0.0, 0.0, 0.0, {9.0, 6}, 1.0), 0.0);
}

TEST(MergeValences, ParityCountsWhereFewVerticesAreLeft) {
  EXPECT_EQ(parity_share(4), 1.0);
  EXPECT_EQ(parity_share(512), 1.0);
  EXPECT_NEAR(parity_share(1024), 1.0 / 16.0, 1e-12);
  EXPECT_LT(parity_share(10'000), 1e-5);
}

// The issued vertices per vertex of every `step`-th level, coarse to fine; the mean and the most.
struct Issued {
  double mean = 0.0;
  double most = 0.0;
  std::size_t at = 0;
};
Issued issued_at_levels(const TriangleMesh& mesh, Valences valences, std::size_t step) {
  BuildOptions options;
  options.cost.valences = valences;
  MergeHistory history = simplify(mesh, simplify_options_of(mesh, options));
  RingMesh rings = std::move(history.base);
  rings.reserve(mesh.positions.size());
  Issued issued;
  double levels = 0.0;
  for (std::size_t next = history.merges.size();;) {
    const std::size_t count = mesh.positions.size() - next;
    std::vector<VertexId> number(mesh.positions.size(), 0);
    VertexId used = 0;
    for (VertexId v = 0; v < number.size(); ++v) number[v] = rings.contains(v) ? used++ : 0;
    std::vector<Triangle> triangles = rings.triangles();
    for (Triangle& t : triangles) t = {number[t[0]], number[t[1]], number[t[2]]};
    const Result<FanMesh> fans = cover_with_fans(count, triangles);
    if (!fans) throw std::runtime_error(fans.error().message);
    const double here = fan_statistics(count, *fans).issued_per_vertex();
    if (here > issued.most) issued = {issued.mean, here, count};
    issued.mean += here;
    levels += 1.0;
    if (next == 0) break;
    for (std::size_t i = 0; i < step && next > 0; ++i) {
      const MergeRecord& merge = history.merges[--next];
      rings.split(merge.root, merge.removed, rings.position_in_ring(merge.root, merge.first),
                  rings.position_in_ring(merge.root, merge.last));
    }
  }
  issued.mean /= levels;
  return issued;
}

TEST(MergeValences, LevelsOfEllipsoidsAreDrawnWithAtMostElevenIssuedVerticesForFour) {
  constexpr double kMost = 2.75;
  std::mt19937 random(5);
  for (const auto& [rings, sides] :
       {std::pair(20U, 20U), std::pair(16U, 25U), std::pair(25U, 16U), std::pair(10U, 40U)}) {
    TriangleMesh mesh = testing::make_sphere(rings + 1, sides);
    ASSERT_EQ(mesh.positions.size(), 402U);
    std::vector<VertexId> number(mesh.positions.size());  // the order of numbers is not what does it
    for (VertexId v = 0; v < number.size(); ++v) number[v] = v;
    for (std::size_t i = number.size(); i > 1; --i) std::swap(number[i - 1], number[random() % i]);
    const std::vector<glm::dvec3> places = mesh.positions;
    for (VertexId v = 0; v < number.size(); ++v) mesh.positions[number[v]] = places[v] * glm::dvec3(1.0, 0.8, 0.6);
    for (Triangle& t : mesh.triangles) t = {number[t[0]], number[t[1]], number[t[2]]};
    const Issued even = issued_at_levels(mesh, Valences::regular, 3);
    EXPECT_LE(even.most, kMost) << rings << " rings, at " << even.at << " vertices";
    const Issued any = issued_at_levels(mesh, Valences::any, 12);
    EXPECT_LT(even.mean, any.mean - 0.01) << rings << " rings";
  }
}

}  // namespace
}  // namespace fanstream
