// The surface of a mesh that refines and coarsens, under a tree of boxes, for searches that take time for what they
// find.
#pragma once

#include <span>
#include <vector>

#include "client/collision/cell_hierarchy.h"
#include "client/collision/four_boxes.h"
#include "common/refine/progressive_mesh.h"

namespace fanstream {

struct LiveTriangle {
  std::array<glm::dvec3, 3> corners{};  // counter-clockwise seen from outside, as decoded from the grid
  std::array<VertexId, 3> numbers{};    // in the mesh
  bool original = false;                // nothing is to be split at its corners: it is one of the full model
};

// Keeps references to both. Not thread safe, but for const members between updates.
class LiveSurface {
 public:
  // Precondition: the mesh is a MeshMemory::live_part and has its index, of which the hierarchy is.
  LiveSurface(const ProgressiveMesh& mesh, const CellHierarchy& cells);

  // After the mesh has changed in these cells: what take_changed_cells() names. Takes time for those cells and what is
  // above them.
  void update(std::span<const std::uint32_t> changed_cells);

  std::uint64_t triangle_count() const { return triangle_count_; }
  Bounds box() const { return frame_.bounds(nodes_[CellHierarchy::root()].boxes.sum()); }  // a little wider than it is
  // The mesh as it is; O(n log n) of what it is, however large the model.
  // `original` is told of every triangle whether it is one of the full model.
  TriangleMesh triangle_mesh(std::vector<bool>* original = nullptr) const;

  // Calls enter(box) from the root downwards, of boxes that have triangles, and, if that says so, goes on below; calls
  // on_triangle(LiveTriangle) in the end. A triangle may come although it does not reach into the boxes entered.
  template <class Enter, class OnTriangle>
  void visit(const Enter& enter, const OnTriangle& on_triangle) const {
    visit_from(CellHierarchy::root(), enter, on_triangle);
  }

  // --- What visit() is made of, for searches with ways of their own ---

  // Four parts of the surface. Boxes are in frame()'s coordinates; a part without triangles has an empty one.
  struct alignas(64) Node {
    static constexpr std::uint32_t kLeaf = 0x80000000U;  // lane_bits() tells it
    FourBoxes boxes;
    std::array<std::uint32_t, 4> triangles{};  // how many
    std::array<std::uint32_t, 4> below{};      // another node, or kLeaf and the part's first block
    std::uint32_t leaves() const { return lane_bits(load4(below.data())); }
  };
  // Four triangles or fewer, side by side in frame()'s coordinates as `rounded[corner][axis]` (lanes of none: NaN), and
  // one after another as they are.
  struct alignas(64) Block {
    static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
    std::array<std::array<Float4, 3>, 3> rounded;
    std::array<std::array<glm::dvec3, 3>, 4> corners;
    std::array<std::array<VertexId, 3>, 4> numbers;
    std::uint32_t next = kNone;  // of the same part
    std::uint8_t count = 0;
    std::uint8_t originals = 0;  // bit k: triangle k is one of the full model
    bool is_original(std::size_t k) const { return ((originals >> k) & 1U) != 0; }
  };
  const BoxFrame& frame() const { return frame_; }
  const Node& node(std::uint32_t n) const { return nodes_[n]; }
  const Block& block(std::uint32_t b) const { return blocks_[b]; }

 private:
  struct Part;
  template <class Enter, class OnTriangle>
  void visit_from(std::uint32_t n, const Enter& enter, const OnTriangle& on_triangle) const {
    const Node& node = nodes_[n];
    for (std::size_t k = 0; k < CellHierarchy::kWidth; ++k) {
      if (node.triangles[k] == 0 || !enter(frame_.bounds(node.boxes.box(k)))) continue;
      if ((node.below[k] & Node::kLeaf) == 0) {
        visit_from(node.below[k], enter, on_triangle);
        continue;
      }
      for (std::uint32_t b = node.below[k] & ~Node::kLeaf; b != Block::kNone; b = blocks_[b].next) {
        const Block& block = blocks_[b];
        for (std::size_t t = 0; t < block.count; ++t) {
          on_triangle(LiveTriangle{block.corners[t], block.numbers[t], block.is_original(t)});
        }
      }
    }
  }

  void take_leaf(std::uint32_t slot);
  void put_leaf(std::uint32_t slot, const CellVertices& cell);
  void add_triangle(Part& part, std::array<VertexId, 3> numbers, const std::array<glm::dvec3, 3>& corners);
  void set_slot(std::uint32_t slot, std::uint32_t below, const FloatBox& box, std::uint32_t triangles);
  void sum_up_changes();
  void note_change(std::uint32_t node);

  const ProgressiveMesh& mesh_;
  const CellHierarchy& cells_;
  BoxFrame frame_;
  std::vector<Node> nodes_;    // the hierarchy's
  std::vector<Block> blocks_;  // of all leaves, and those that are free
  std::uint32_t free_ = Block::kNone;
  std::vector<std::uint32_t> changed_;  // nodes of which the sum may have changed: a heap, the largest on top
  std::uint64_t triangle_count_ = 0;
};

}  // namespace fanstream
