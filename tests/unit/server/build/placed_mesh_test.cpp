#include "server/build/placed_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/support/asset_helpers.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

std::vector<GridPoint> codes_of(const TriangleMesh& mesh, const PositionGrid& grid) {
  std::vector<GridPoint> codes;
  for (const glm::dvec3& p : mesh.positions) codes.push_back(grid.encode(p));
  return codes;
}

TEST(PlacedMesh, IsTheModelUnderOtherNumbers) {
  for (const auto& [name, mesh] : testing::model_shapes()) {
    SCOPED_TRACE(name);
    const PositionGrid grid = PositionGrid::fit(mesh.positions, 12);
    const PlacedMesh placed(mesh.triangles, codes_of(mesh, grid), grid);
    ASSERT_EQ(std::set<VertexId>(placed.number.begin(), placed.number.end()).size(), mesh.positions.size());
    for (VertexId v = 0; v < mesh.positions.size(); ++v) {
      EXPECT_EQ(placed.places[placed.number[v]], glm::vec3(grid.coordinates(placed.codes[v])));
    }
    std::vector<Triangle> expected;
    for (const Triangle& t : mesh.triangles)
      expected.push_back({placed.number[t[0]], placed.number[t[1]], placed.number[t[2]]});
    std::sort(expected.begin(), expected.end());
    std::vector<Triangle> faces = placed.faces;
    std::sort(faces.begin(), faces.end());
    EXPECT_EQ(faces, expected) << "corners keep their order";
  }
}

TEST(PlacedMesh, NeighboursHaveCloseNumbers) {
  const TriangleMesh mesh = testing::make_terrain(60, 50, 1);
  const PositionGrid grid = PositionGrid::fit(mesh.positions, 12);
  const PlacedMesh placed(mesh.triangles, codes_of(mesh, grid), grid);
  double apart = 0.0;
  for (const Triangle& t : placed.faces) apart += std::max({t[0], t[1], t[2]}) - std::min({t[0], t[1], t[2]});
  const auto vertices = static_cast<double>(mesh.positions.size());
  EXPECT_LT(apart / static_cast<double>(placed.faces.size()), 0.1 * vertices) << "half of them if they were shuffled";
}

TEST(PlacedMesh, PartsFollowEachOtherAndHoldAllFaces) {
  for (const auto& [name, mesh] : testing::model_shapes()) {
    const PositionGrid grid = PositionGrid::fit(mesh.positions, 12);
    for (const std::uint32_t faces_of_part : {1U, 50U, 1'000'000U}) {
      SCOPED_TRACE(name + ", " + std::to_string(faces_of_part));
      const PlacedMesh placed(mesh.triangles, codes_of(mesh, grid), grid, faces_of_part);
      EXPECT_GE(placed.part_count(), 1U);
      EXPECT_LE(placed.part_count(), 4U);
      EXPECT_EQ(placed.part_begin(0), 0U);
      EXPECT_EQ(placed.part_begin(placed.part_count()), placed.faces.size());
      for (std::uint32_t p = 0; p < placed.part_count(); ++p) {
        const std::uint32_t faces = placed.part_begin(p + 1) - placed.part_begin(p);
        EXPECT_GE(faces, placed.part_count() == 1 ? 0 : faces_of_part);
      }
    }
  }
}

}  // namespace
}  // namespace fanstream
