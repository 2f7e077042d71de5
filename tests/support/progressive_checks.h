// What must hold of a ProgressiveMesh whatever was done to it, found out from the mesh itself.
#pragma once

#include <gtest/gtest.h>

#include "tests/support/asset_helpers.h"

namespace fanstream::testing {

struct Topology {
  std::size_t components = 0;
  std::int64_t euler_characteristic = 0;
  std::size_t boundary_loops = 0;
  bool operator==(const Topology&) const = default;
};
// Precondition: an oriented manifold.
Topology topology_of(const TriangleMesh& mesh);

// The live cells beside each live cell, by the edges of the mesh.
std::vector<std::vector<std::uint32_t>> cells_beside(const ProgressiveMesh& mesh);

// That no cell is finer than target and held segments allow, that no cell could take another generation by the implicit
// rule, and that neighbours() are those of the edges. `damaged` cells may lack more. Of a MeshMemory::live_part.
::testing::AssertionResult is_largest_mesh(const ProgressiveMesh& mesh, std::span<const std::uint32_t> damaged = {});

// That the bounds of every live cell hold all its faces.
::testing::AssertionResult bounds_hold(const ProgressiveMesh& mesh);

// Everything that must be the same in meshes of the same segments and targets: StateImage, and which cell owns what.
struct RefinedImage {
  StateImage state;
  std::vector<std::uint32_t> cells;        // by vertex
  std::vector<std::uint32_t> generations;  // by cell
  bool operator==(const RefinedImage&) const = default;
};
RefinedImage refined_image_of(const ProgressiveMesh& mesh);

}  // namespace fanstream::testing
