// Assets built in memory and read back, for the tests of building and refining.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/refine/progressive_mesh.h"
#include "server/build/asset_builder.h"
#include "tests/support/seeded_random.h"

namespace fanstream::testing {

struct OpenAsset {
  std::vector<std::byte> bytes;
  AssetPreamble preamble;
  std::shared_ptr<const AssetHead> head;
  std::shared_ptr<const AssetIndex> index;  // with all pages

  std::shared_ptr<const AssetIndex> first_index() const;  // without: as a client has it at first
  std::span<const std::byte> head_bytes() const { return std::span(bytes).first(preamble.head_bytes); }
  std::span<const std::byte> index_bytes() const {
    return std::span(bytes).subspan(preamble.head_bytes, preamble.index_bytes);
  }
  std::span<const std::byte> segment(std::uint32_t cell, std::uint32_t number) const;
  // (cell, segment) of all segments that have bytes, without pages, by cell.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> segments() const;
};

// Reads what build_asset wrote.
Result<OpenAsset> open_asset(std::vector<std::byte> bytes);

// Small cells and segments, so that small models have several slabs, layers and many cells, and pages.
BuildOptions small_cells();

// Builds and opens; a failure is the test's.
OpenAsset build_and_open(const TriangleMesh& mesh, const BuildOptions& options = small_cells());

// With the index set and no segment.
std::unique_ptr<ProgressiveMesh> start(const OpenAsset& asset);
// Adds all segments and refines; a failure is the test's.
std::unique_ptr<ProgressiveMesh> fully_refined(const OpenAsset& asset);

// The mesh with every vertex moved to its point of the grid.
TriangleMesh on_grid(const TriangleMesh& mesh, const PositionGrid& grid);

// Whether the mesh as it is now is an oriented manifold.
bool is_manifold(const ProgressiveMesh& mesh, std::string* why);

// All that a state is made of, as it can be compared, to where each fan starts and the order in which faces stand. Of
// vertices that are not in the mesh nothing is kept.
struct StateImage {
  std::vector<std::vector<VertexId>> rings;
  std::vector<Triangle> faces;
  std::vector<std::array<std::int32_t, 3>> places;
  std::vector<std::array<int, 2>> contexts;  // next, touched
  bool operator==(const StateImage&) const = default;
};
StateImage image_of(const ProgressiveMesh& mesh);

// Generated cleaned meshes of all topologies that matter, by name.
std::vector<std::pair<std::string, TriangleMesh>> model_shapes();

}  // namespace fanstream::testing
