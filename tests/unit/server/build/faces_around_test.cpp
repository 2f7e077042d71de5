#include "server/build/faces_around.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/mesh_generators.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

TEST(FacesAround, ListsTheFacesOfEachVertexByRisingNumbers) {
  const TriangleMesh mesh = testing::make_sphere(9, 12);
  const FacesAround around(mesh.positions.size(), mesh.triangles);
  for (VertexId v = 0; v < mesh.positions.size(); ++v) {
    std::vector<std::uint32_t> expected;
    for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
      if (std::count(mesh.triangles[f].begin(), mesh.triangles[f].end(), v) != 0) expected.push_back(f);
    }
    const auto listed = around.of(v);
    EXPECT_EQ(std::vector<std::uint32_t>(listed.begin(), listed.end()), expected) << "vertex " << v;
  }
}

TEST(FacesAround, ReplacedAndRemovedListsLeaveTheOthersAlone) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    testing::SeededRandom random(seed);
    const TriangleMesh mesh = testing::make_grid(6, 5);
    FacesAround around(mesh.positions.size(), mesh.triangles);
    std::vector<std::vector<std::uint32_t>> expected;
    for (VertexId v = 0; v < mesh.positions.size(); ++v)
      expected.emplace_back(around.of(v).begin(), around.of(v).end());
    for (int step = 0; step < 300; ++step) {
      const VertexId v = random.below(static_cast<std::uint32_t>(expected.size()));
      if (random.one_in(2)) {
        expected[v].resize(random.below(12));
        const auto faces = around.replace(v, expected[v].size());
        for (std::size_t i = 0; i < faces.size(); ++i) faces[i] = expected[v][i] = random.below(1000);
      } else {
        const std::uint32_t face = expected[v].empty() || random.one_in(5)
                                       ? 5000
                                       : expected[v][random.below(static_cast<std::uint32_t>(expected[v].size()))];
        around.remove(v, face);
        const auto found = std::find(expected[v].begin(), expected[v].end(), face);
        if (found != expected[v].end()) expected[v].erase(found);
      }
    }
    for (VertexId v = 0; v < expected.size(); ++v) {
      EXPECT_EQ(std::vector<std::uint32_t>(around.of(v).begin(), around.of(v).end()), expected[v]) << "vertex " << v;
    }
  }
}

}  // namespace
}  // namespace fanstream
