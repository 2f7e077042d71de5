#include "server/build/coded_history.h"

#include <cassert>

namespace fanstream {

CodedHistory::CodedHistory(const MergeHistory& merges, std::vector<GridPoint> places)
    : history(merges), displacements(merges.merges.size()) {
  for (std::uint32_t generation = generation_count(); generation >= 1; --generation) {
    for (std::uint32_t m = generation_begin(generation); m < generation_end(generation); ++m) {
      const MergeRecord& merge = history.merges[m];
      displacements[m] = places[merge.removed] - places[merge.root];
      places[merge.root] = place_after_merge(places[merge.root], places[merge.removed], merge.parent, generation);
    }
  }
  base_places = std::move(places);
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
      original_(vertex_count, kOutside),
      number_(vertex_count, kOutside),
      latest_(vertex_count, kNone),
      counts_(vertex_count, 0),
      previous_(coded.history.merges.size(), kNone) {
  for (VertexId v = 0; v < base_numbers.size(); ++v) {
    original_[v] = base_numbers[v];
    number_[base_numbers[v]] = v;
  }
}

void HistorySource::begin_generation(std::uint32_t generation) {
  for (std::uint32_t m = coded_.generation_begin(generation); m < coded_.generation_end(generation); ++m) {
    const VertexId root = coded_.history.merges[m].root;
    previous_[m] = latest_[root];
    latest_[root] = m;
    ++counts_[root];
  }
}

const MergeRecord& HistorySource::merge_of(VertexId root) const {
  return coded_.history.merges[latest_[original_[root]]];
}

FanSplit HistorySource::split(const RingGeometry& ring, VertexId root) const {
  const std::uint32_t m = latest_[original_[root]];
  const MergeRecord& merge = coded_.history.merges[m];
  const auto position = [&](VertexId wing) {
    const VertexId wanted = wing == kOutside ? kOutside : number_[wing];
    std::uint32_t i = 0;
    while (i < ring.size() && ring.id(i) != wanted) ++i;
    assert(i < ring.size());
    return i;
  };
  return {root, position(merge.first), position(merge.last), merge.parent, coded_.displacements[m]};
}

void HistorySource::made(const SplitUndo& split, VertexId added) {
  const VertexId root = original_[split.root];
  const std::uint32_t m = latest_[root];
  original_[added] = coded_.history.merges[m].removed;
  number_[original_[added]] = added;
  latest_[root] = previous_[m];
  --counts_[root];
}

}  // namespace fanstream
