// A merge history on the grid, and its replay from the coarsest mesh in the order in which it is coded.
#pragma once

#include <functional>

#include "common/asset/asset_layout.h"
#include "common/refine/cell_coder.h"
#include "server/build/simplifier.h"

namespace fanstream {

// What a split has to tell of places beyond points of its generation's lattice, and beyond what was known before.
struct SplitLowBits {
  LowBits parent = 0;  // before it
  LowBits kept = 0;    // after it: of the root,
  LowBits added = 0;   // and of the new vertex
};

// Places of all vertices as merges leave them and a decoder knows them, and each merge's displacement. Generations are
// numbered as in the asset: 1 is the coarsest.
struct CodedHistory {
  const MergeHistory& history;
  PlacePrecision precision;
  std::vector<GridPoint> displacements;  // by merge, in points of its generation's lattice
  std::vector<GridPoint> shifts;         // by merge, of free parents, likewise; empty if there are none
  std::vector<SplitLowBits> low_bits;    // by merge; empty if exact
  std::vector<GridPoint> model_places;   // by the model's vertex, on the grid
  std::vector<GridPoint> base_places;    // by the model's vertex, where the vertex is in the base

  // `places`: the model's on the grid.
  CodedHistory(const MergeHistory& merges, std::vector<GridPoint> places, const PositionGrid& grid,
               const PlacePrecision& place_precision = {});
  // Where the root of a merge is shown afterwards, given where it and the removed vertex are shown before.
  GridPoint place_after(std::uint32_t merge, const GridPoint& root, const GridPoint& removed) const;
  bool has_free_parents() const { return !shifts.empty(); }
  GridPoint shift(std::size_t merge) const { return shifts.empty() ? GridPoint(0) : shifts[merge]; }
  std::uint32_t generation_count() const { return history.generation_count(); }
  std::uint32_t generation_begin(std::uint32_t generation) const;  // into merges
  std::uint32_t generation_end(std::uint32_t generation) const;
  BaseMesh base(std::vector<VertexId>& numbers) const;  // numbers: for each base vertex, the model's
  std::uint32_t generation_of(std::uint32_t merge) const { return generations_[merge]; }

 private:
  GridPoint parent_of(std::uint32_t merge, const GridPoint& root, const GridPoint& removed) const;
  void find_known_on();

  std::vector<std::uint8_t> generations_;  // by merge
  // By merge: the generation on whose lattice the root is known afterwards (PlacePrecision::known_in).
  std::vector<std::uint8_t> known_on_;
};

// Knows the splits of a history while it is replayed. The Source of code_generation.
class HistorySource {
 public:
  HistorySource(const CodedHistory& coded, const std::vector<VertexId>& base_numbers, std::size_t vertex_count);

  // When each vertex of FM0 is first split, by coded number.
  std::vector<std::uint8_t> next_splits_of_base() const;
  void describe(SplitInProgress& split) const;
  LowBits root_low_bits(VertexId root) const {
    return coded_.low_bits.empty() ? 0 : coded_.low_bits[to_undo_[original_[root]]].parent;
  }
  void made(const SplitUndo& split, VertexId added);

  VertexId original(VertexId v) const { return original_[v]; }
  const MergeRecord& merge_of(VertexId root) const {
    return coded_.history.merges[to_undo_[original_[root]]];
  }  // the next one of this root

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  std::uint8_t generation_of(std::uint32_t merge) const {
    return merge == kNone ? kNeverSplit : static_cast<std::uint8_t>(coded_.generation_of(merge));
  }

  const CodedHistory& coded_;
  std::uint32_t base_count_;
  std::vector<VertexId> original_;      // by coded number
  std::vector<VertexId> number_;        // by the model's vertex
  std::vector<std::uint32_t> to_undo_;  // by the model's vertex: its next merge to undo
  std::vector<std::uint32_t> after_;    // by merge: the next one of its root
};

}  // namespace fanstream
