// The surface of a mesh that refines and coarsens, cell by cell as flat arrays under a tree of boxes, for searches that
// take time for what they find.
#pragma once

#include <span>
#include <vector>

#include "client/collision/cell_hierarchy.h"
#include "client/collision/surface_patch.h"
#include "common/refine/progressive_mesh.h"

namespace fanstream {

// Keeps references to both. Not thread safe, but for const members between updates.
class LiveSurface {
 public:
  // Precondition: the mesh is a MeshMemory::live_part and has its index, of which the hierarchy is.
  LiveSurface(const ProgressiveMesh& mesh, const CellHierarchy& cells);

  // After the mesh has changed in these cells: what take_changed_cells() names. Takes time for those cells, and for
  // each the logarithm of all.
  void update(std::span<const std::uint32_t> changed_cells);

  std::uint64_t triangle_count() const;
  Bounds box() const;
  // The mesh as it is; O(n log n) of what it is, however large the model.
  // `original` is told of every triangle whether it is one of the full model.
  TriangleMesh triangle_mesh(std::vector<bool>* original = nullptr) const;

  // Of a node of the hierarchy: the box of the faces below it now (kNoBounds: there is none), and how many.
  struct Part {
    Bounds box = kNoBounds;
    std::uint32_t triangles = 0;
    friend bool operator==(const Part&, const Part&);
  };

  // Calls enter(part) from the root downwards and, if that says so, goes on below; at cells calls
  // on_patch(cell, patch). Parts without triangles are left out.
  template <class Enter, class OnPatch>
  void visit(const Enter& enter, const OnPatch& on_patch) const {
    if (cells_.is_empty()) {
      if (whole_part_.triangles > 0 && enter(whole_part_)) on_patch(0U, whole_);
      return;
    }
    visit_from(CellHierarchy::root(), enter, on_patch);
  }

  // What visit() is made of, for searches with an order of their own. Precondition: has_tree().
  bool has_tree() const { return !cells_.is_empty(); }
  const CellHierarchy& cells() const { return cells_; }
  const Part& part(std::uint32_t node) const { return parts_[node]; }
  const SurfacePatch& patch(std::uint32_t cell) const { return patches_[cell]; }

 private:
  template <class Enter, class OnPatch>
  void visit_from(std::uint32_t n, const Enter& enter, const OnPatch& on_patch) const {
    if (parts_[n].triangles == 0 || !enter(parts_[n])) return;
    const CellHierarchy::Node& node = cells_.node(n);
    if (node.cell != CellHierarchy::kNone && !patches_[node.cell].triangles.empty()) {
      on_patch(node.cell, patches_[node.cell]);
      return;
    }
    for (const std::uint32_t below : node.below) {
      if (below != CellHierarchy::kNone) visit_from(below, enter, on_patch);
    }
  }
  Part sum(std::uint32_t n) const;
  void give_back(SurfacePatch& patch);

  const ProgressiveMesh& mesh_;
  const CellHierarchy& cells_;
  PatchMaker maker_;
  std::vector<Part> parts_;            // by node
  std::vector<SurfacePatch> patches_;  // by cell; empty but for those that own vertices now
  std::vector<SurfacePatch> spare_;    // memory for patches to come
  SurfacePatch whole_;                 // of a mesh without cells
  Part whole_part_;
};

}  // namespace fanstream
