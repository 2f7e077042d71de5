// The faces of the source file, where the live mesh has come as far: its triangles joined into polygons again.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/asset/polygon_section.h"
#include "common/mesh/triangle_joining.h"
#include "common/refine/progressive_mesh.h"

namespace fanstream {

// Which edges are diagonals, decoded block by block as the mesh allows. A block is known once all of its vertices and
// all their neighbours have been split for the last time; what is known stays known, whatever is coarsened afterwards.
// Not thread safe.
class SourcePolygons {
 public:
  // Of an asset's polygon section. Errors as read_polygons.
  static Result<SourcePolygons> read(std::span<const std::byte> bytes, const AssetHead& head, const AssetIndex& index,
                                     const std::string& name);

  // Decodes the blocks that the mesh now has in full; linear in the mesh as it is. Fails (bad_input) where one is
  // damaged, which then stays unknown; the others are decoded all the same, and later calls do not fail again for it.
  // Precondition: the mesh is of the same asset and has its index.
  Result<void> update(const ProgressiveMesh& mesh);

  // Block of a vertex of the state of the mesh as it is; nothing if its cell is not of the last slab.
  static constexpr std::uint32_t kNoBlock = ~std::uint32_t{0};
  std::uint32_t block_of(const FanState& state, VertexId v) const {
    if (one_block_) return 0;
    const std::uint32_t cell = state.cells[v];
    return cell >= first_cell_ && cell - first_cell_ < diagonals_.size() ? cell - first_cell_ : kNoBlock;
  }
  bool is_known(std::uint32_t block) const { return block != kNoBlock && state_[block] == BlockState::known; }
  std::uint32_t known_count() const { return known_count_; }
  // The ends by their numbers in the asset. Precondition: is_known(block), the block of the lower one.
  bool is_diagonal(std::uint32_t block, VertexId a, VertexId b) const;
  const PolygonSection& section() const { return section_; }

 private:
  enum class BlockState : std::uint8_t { waiting, known, damaged };

  std::string name_;
  PolygonSection section_;
  glm::vec3 unit_{1.0F};
  bool one_block_ = false;
  std::uint32_t first_cell_ = 0;
  std::uint32_t known_count_ = 0;
  std::vector<BlockState> state_;                      // by block
  std::vector<std::vector<std::uint64_t>> diagonals_;  // by block: keys of edges (diagonal_coder.h), ascending
};

// The live mesh as faces. Vertices are numbered as in ProgressiveMesh::triangle_mesh(), whose positions these are.
struct LiveFaces {
  std::vector<glm::dvec3> positions;
  std::vector<Triangle> triangles;  // as there; JoinedFaces::face_of_triangle is of these
  JoinedFaces faces;
  // By face: it is a face of the full model, to its last corner. Its vertices are never split again, and nothing of
  // its polygon is still to come. All other faces are single triangles.
  std::vector<std::uint8_t> finest;
};

// `polygons`: null if the asset has none; then every face is a triangle.
LiveFaces live_faces(const ProgressiveMesh& mesh, const SourcePolygons* polygons);

}  // namespace fanstream
