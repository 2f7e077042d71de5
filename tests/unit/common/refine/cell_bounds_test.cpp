#include "common/refine/cell_bounds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "tests/support/mesh_generators.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

struct OnGrid {
  PositionGrid grid;
  FanState state;
};

OnGrid on_grid(const TriangleMesh& mesh, int bits) {
  OnGrid result{PositionGrid::fit(mesh.positions, bits), {}};
  BaseMesh base;
  for (const glm::dvec3& p : mesh.positions) base.places.push_back(result.grid.encode(p));
  base.triangles = mesh.triangles;
  result.state = FanState::from_base(base, mesh.positions.size());
  return result;
}

CellBounds bounds_of_cell(const OnGrid& mesh, std::uint32_t cell, std::vector<VertexId> vertices) {
  BoundsScratch scratch;
  const CellVertices own{cell, std::move(vertices), 0, 0, 0};
  return cell_bounds(mesh.state, own, mesh.grid, scratch);
}

TEST(CellBounds, OfAFlatPieceAreItsFacesAndOneDirection) {
  const TriangleMesh flat = testing::make_grid(10, 10);  // of unit squares or a unit square
  OnGrid mesh = on_grid(flat, 12);
  // The middle vertex alone: its faces reach one square to each side.
  const VertexId middle = 5 * 11 + 5;
  std::vector<VertexId> others;
  for (VertexId v = 0; v < flat.positions.size(); ++v) {
    if (v != middle) others.push_back(v);
  }
  mesh.state.set_cell(1, others);
  const VertexId own[] = {middle};
  mesh.state.set_cell(0, own);
  const CellBounds bounds = bounds_of_cell(mesh, 0, {middle});
  const double side = glm::length(flat.positions[1] - flat.positions[0]);
  EXPECT_NEAR(glm::length(bounds.centre - flat.positions[middle]), 0.0, side * 0.01);
  EXPECT_NEAR(bounds.radius, side * std::sqrt(2.0), side * 0.01);
  EXPECT_NEAR(std::abs(bounds.cone_axis.z) + std::abs(bounds.cone_axis.y) + std::abs(bounds.cone_axis.x), 1.0, 1e-6);
  EXPECT_GT(bounds.cone_cosine, 0.99999F);
  EXPECT_LT(bounds_of_cell(mesh, 2, {}).radius, 0.0) << "no vertex, no face";
}

TEST(CellBounds, OfAClosedSurfaceLookAnywhere) {
  const TriangleMesh sphere = testing::make_sphere(20, 30, 2.0);
  OnGrid mesh = on_grid(sphere, 12);
  std::vector<VertexId> all(sphere.positions.size());
  for (VertexId v = 0; v < all.size(); ++v) all[v] = v;
  mesh.state.set_cell(0, all);
  const CellBounds bounds = bounds_of_cell(mesh, 0, all);
  EXPECT_NEAR(bounds.radius, 2.0, 0.01);
  EXPECT_NEAR(glm::length(bounds.centre), 0.0, 0.01);
  EXPECT_LT(bounds.cone_cosine, -0.9F);
}

// Cells cut at random: every face is in the bounds of all cells that have a corner of it, and no bound is much too
// wide.
TEST(CellBounds, HoldEveryFaceAndNotMuchMore) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    testing::SeededRandom random(seed);
    const TriangleMesh shape = seed % 2 == 0 ? testing::make_terrain(20, 18, seed) : testing::make_torus(24, 16);
    OnGrid mesh = on_grid(shape, 10);
    std::vector<std::vector<VertexId>> cells(5);
    for (VertexId v = 0; v < shape.positions.size(); ++v)
      cells[random.one_in(3) ? random.below(5) : v % 5].push_back(v);
    for (std::uint32_t c = 0; c < 5; ++c) mesh.state.set_cell(c, cells[c]);
    std::vector<CellBounds> bounds;
    for (std::uint32_t c = 0; c < 5; ++c) bounds.push_back(bounds_of_cell(mesh, c, cells[c]));
    std::vector<double> farthest(5, 0.0);
    std::vector<double> widest(5, 1.0);
    for (const Triangle& t : shape.triangles) {
      std::array<glm::dvec3, 3> at;
      for (std::size_t i = 0; i < 3; ++i) at[i] = mesh.grid.decode(mesh.state.vertices[t[i]].place);
      const glm::dvec3 cross = glm::cross(at[1] - at[0], at[2] - at[0]);
      for (const VertexId v : t) {
        const std::uint32_t c = mesh.state.cells[v];
        for (const glm::dvec3& p : at) farthest[c] = std::max(farthest[c], glm::length(p - bounds[c].centre));
        if (glm::length(cross) == 0.0) continue;
        widest[c] = std::min(widest[c], glm::dot(glm::normalize(cross), glm::dvec3(bounds[c].cone_axis)));
      }
    }
    for (std::size_t c = 0; c < 5; ++c) {
      EXPECT_LE(farthest[c], bounds[c].radius);
      EXPECT_NEAR(farthest[c], bounds[c].radius, 1e-6 * bounds[c].radius);
      EXPECT_GE(widest[c], bounds[c].cone_cosine);
      EXPECT_NEAR(widest[c], bounds[c].cone_cosine, 1e-5);
    }
  }
}

}  // namespace
}  // namespace fanstream
