#include "server/build/coded_history.h"

#include <cassert>
#include <glm/common.hpp>

namespace fanstream {

CodedHistory::CodedHistory(const MergeHistory& merges, std::vector<GridPoint> places, const PositionGrid& grid,
                           const PlacePrecision& place_precision)
    : history(merges),
      precision(place_precision),
      displacements(merges.merges.size()),
      shifts(merges.free_places.size(), GridPoint(0)),
      low_bits(precision.is_exact() ? 0 : merges.merges.size()),
      model_places(places) {
  find_known_on();
  std::vector<std::uint8_t> next(model_places.size(), kNeverSplit);  // split, of the merges so far
  for (std::uint32_t m = 0; m < history.merges.size(); ++m) {
    const MergeRecord& merge = history.merges[m];
    const std::uint32_t generation = generations_[m];
    const PlaceLattice& lattice = precision.lattice(generation);
    const GridPoint root = lattice.point_of(places[merge.root]);
    displacements[m] = lattice.point_of(places[merge.removed]) - root;
    if (merge.parent == ParentPosition::free) {
      // On the grid, cut off or not: halfway is, and so is the parent.
      const GridPoint wanted =
          lattice.point_of(grid.encode(history.free_places[m])) - root - halfway_offset(displacements[m], generation);
      shifts[m] = glm::clamp(wanted, GridPoint(-kMostShift), GridPoint(kMostShift));
    }
    if (!low_bits.empty()) {
      const LatticeStep before(precision.lattice(known_on_[m]), lattice);
      const auto after = [&](VertexId v) {
        const PlaceLattice& known = precision.known(generation, next[v]);
        return LatticeStep(lattice, known).low_bits_of(known.point_of(places[v]));
      };
      low_bits[m] = {before.low_bits_of(parent_of(m, places[merge.root], places[merge.removed])), after(merge.root),
                     after(merge.removed)};
    }
    next[merge.root] = generations_[m];
    places[merge.root] = place_after(m, places[merge.root], places[merge.removed]);
  }
  base_places = std::move(places);
}

void CodedHistory::find_known_on() {
  generations_.resize(history.merges.size());
  known_on_.resize(history.merges.size());
  std::vector<std::uint8_t> latest(model_places.size(), 0);
  for (std::uint32_t generation = 1; generation <= generation_count(); ++generation) {
    for (std::uint32_t m = generation_end(generation); m-- > generation_begin(generation);) {
      const MergeRecord& merge = history.merges[m];
      generations_[m] = static_cast<std::uint8_t>(generation);
      known_on_[m] = static_cast<std::uint8_t>(PlacePrecision::known_in(latest[merge.root], generation));
      latest[merge.root] = latest[merge.removed] = generations_[m];
    }
  }
}

// A point of the lattice of the merge's generation.
GridPoint CodedHistory::parent_of(std::uint32_t merge, const GridPoint& root, const GridPoint& removed) const {
  const PlaceLattice& lattice = precision.lattice(generations_[merge]);
  return place_after_merge(lattice.point_of(root), lattice.point_of(removed), history.merges[merge].parent,
                           generations_[merge], shift(merge));
}

GridPoint CodedHistory::place_after(std::uint32_t merge, const GridPoint& root, const GridPoint& removed) const {
  const GridPoint parent = parent_of(merge, root, removed);
  if (precision.is_exact()) return parent;
  const PlaceLattice& known = precision.lattice(known_on_[merge]);
  return known.code_of(LatticeStep(known, precision.lattice(generations_[merge])).coarse(parent));
}

std::uint32_t CodedHistory::generation_begin(std::uint32_t generation) const {
  return history.generation_begin[generation_count() - generation];
}
std::uint32_t CodedHistory::generation_end(std::uint32_t generation) const {
  return history.generation_begin[generation_count() - generation + 1];
}

BaseMesh CodedHistory::base(std::vector<VertexId>& numbers) const {
  BaseMesh base;
  numbers.clear();
  std::vector<VertexId> renumbered(history.base.vertex_capacity(), kOutside);
  for (VertexId v = 0; v < renumbered.size(); ++v) {
    if (!history.base.contains(v)) continue;
    renumbered[v] = static_cast<VertexId>(numbers.size());
    numbers.push_back(v);
    base.places.push_back(base_places[v]);
  }
  base.triangles = history.base.triangles();
  for (Triangle& t : base.triangles) {
    for (VertexId& v : t) v = renumbered[v];
  }
  return base;
}

HistorySource::HistorySource(const CodedHistory& coded, const std::vector<VertexId>& base_numbers,
                             std::size_t vertex_count)
    : coded_(coded),
      base_count_(static_cast<std::uint32_t>(base_numbers.size())),
      original_(vertex_count, kOutside),
      number_(vertex_count, kOutside),
      to_undo_(vertex_count, kNone),
      after_(coded.history.merges.size(), kNone) {
  for (VertexId v = 0; v < base_numbers.size(); ++v) {
    original_[v] = base_numbers[v];
    number_[base_numbers[v]] = v;
  }
  // Merges lie in the order they were made: the last one of a root is the first to be undone.
  for (std::uint32_t m = 0; m < after_.size(); ++m) {
    const VertexId root = coded.history.merges[m].root;
    after_[m] = to_undo_[root];
    to_undo_[root] = m;
  }
}

std::vector<std::uint8_t> HistorySource::next_splits_of_base() const {
  std::vector<std::uint8_t> next(base_count_);
  for (VertexId v = 0; v < base_count_; ++v) next[v] = generation_of(to_undo_[original_[v]]);
  return next;
}

void HistorySource::describe(SplitInProgress& split) const {
  const std::uint32_t m = to_undo_[original_[split.split.root]];
  const MergeRecord& merge = coded_.history.merges[m];
  const RingGeometry& ring = split.ring;
  const auto position = [&](VertexId wing) {
    const VertexId wanted = wing == kOutside ? kOutside : number_[wing];
    std::uint32_t i = 0;
    while (i < ring.size() && ring.id(i) != wanted) ++i;
    assert(i < ring.size());
    return i;
  };
  split.split = {split.split.root, position(merge.first),   position(merge.last),
                 merge.parent,     coded_.displacements[m], coded_.shift(m)};
  split.root_next = generation_of(after_[m]);
  split.added_next = generation_of(to_undo_[merge.removed]);
  if (coded_.low_bits.empty()) return;
  split.kept_low = coded_.low_bits[m].kept;
  split.added_low = coded_.low_bits[m].added;
}

void HistorySource::made(const SplitUndo& split, VertexId added) {
  const VertexId root = original_[split.root];
  const std::uint32_t m = to_undo_[root];
  original_[added] = coded_.history.merges[m].removed;
  number_[original_[added]] = added;
  to_undo_[root] = after_[m];
}

}  // namespace fanstream
