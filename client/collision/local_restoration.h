// Original and simplified regions in one mesh: within a focus the model is what it is in full, elsewhere as coarse as
// one likes, without a crack in between. COLLISION.md explains how.
//
//   LocalRestoration model(head, index);
//   for (each segment) model.add_segment(...);         // all of them, or what missing() names
//   model.measure();                                   // where all of them are held: searches become exact
//   model.set_coarseness(0.01 * diagonal);
//   for (;;) {
//     model.move(focus);
//     find_contacts(model.surface(), plane, contacts); // plane_contacts.h, mesh_contacts.h
//   }
//
// *Covered.* After a move of which `covered` is true, every triangle of the full model that is in focus
// (FocusTest::holds) is a triangle of the mesh, with the same corners to the last bit.
//
// Source: Odauchi, Tsukiji, "Real-time local mesh simplification and its application", whose search for what to restore
// goes through all polygons. Here it goes down the tree of cells: the logarithm of the model's size, and what it finds;
// and the mesh changes only where the focus comes or goes.
#pragma once

#include <memory>
#include <vector>

#include "client/collision/focus.h"
#include "client/collision/live_surface.h"
#include "client/collision/place_tree.h"
#include "common/refine/progressive_mesh.h"

namespace fanstream {

struct RestorationMove {
  std::uint64_t applied = 0;             // splits
  std::uint64_t undone = 0;              // splits
  std::uint32_t focus_cells = 0;         // restored for the focus's sake; 0: it touches no part of the model
  bool covered = true;                   // false: segments are missing or damaged
  std::vector<MeshMove::Damage> damage;  // noticed now
};

// No I/O, threads or clocks. Not thread safe; distinct objects are independent.
class LocalRestoration {
 public:
  // Starts as FM0.
  LocalRestoration(std::shared_ptr<const AssetHead> head, std::shared_ptr<const AssetIndex> index);
  LocalRestoration(const LocalRestoration&) = delete;
  LocalRestoration& operator=(const LocalRestoration&) = delete;

  // As of ProgressiveMesh.
  Result<void> add_segment(std::uint32_t cell, std::uint32_t segment, std::span<const std::byte> bytes);

  // Refines everything once, notes where each cell lies in the full model, and goes back to FM0. Before, cells are
  // searched by where they lie now, widened by how far that may be off: the focus is covered all the same, but more
  // cells are restored than would have to be. Fails where a segment is missing or damaged.
  Result<void> measure();
  bool is_measured() const { return measured_; }

  // How far the mesh may be off the original where it is not in focus, in the model's units, by the cells' certified
  // errors: 0 is the original everywhere, infinity (as at first) FM0. Linear in cells; takes effect with the next move.
  // Precondition: not negative, not NaN.
  void set_coarseness(double error);

  // Precondition: check_focus(focus). Takes time for what changes and for the cells in focus, and the logarithm of all.
  RestorationMove move(const Focus& focus);

  // The segments that the last move lacks, as (cell, how many of its first segments): add them and move again, which
  // may show that more are needed. Empty where nothing is missing. Linear in cells.
  std::vector<CellTarget> missing() const;

  const LiveSurface& surface() const { return surface_; }
  const ProgressiveMesh& mesh() const { return mesh_; }
  // How far the mesh may be off at most, where it is not original, in the model's units. Linear in cells.
  double largest_error() const;

 private:
  std::uint32_t needed_segments(std::uint32_t cell, const FocusTest& test) const;
  void find_cells(const FocusTest& test, std::vector<CellTarget>& found);
  void change_targets(const std::vector<CellTarget>& in_focus);
  void note_places(std::span<const std::uint32_t> changed_cells);
  Bounds box_of_faces(std::uint32_t cell) const;
  bool lacks_splits(std::uint32_t cell) const;
  double error_now(std::uint32_t cell) const;

  ProgressiveMesh mesh_;
  CellHierarchy cells_;
  LiveSurface surface_;
  PlaceTree places_;                       // where cells' parts of the full model lie
  std::vector<std::uint32_t> outside_;     // by cell: its target out of focus
  std::vector<CellTarget> in_focus_;       // cells and what they need, as of the last move
  std::vector<CellTarget> found_;          // scratch
  std::vector<std::uint64_t> last_found_;  // by cell: the search that found it
  std::uint64_t searches_ = 1;
  std::vector<std::uint32_t> place_in_found_;  // scratch, by cell
  std::vector<Bounds> place_of_step_;  // by segment: where a cell's part lies while it lacks this one; until measured
  std::vector<CellTarget> changes_;    // for the next move
  bool measured_ = false;
};

}  // namespace fanstream
