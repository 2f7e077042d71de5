#include "common/refine/progressive_mesh.h"

#include <algorithm>

#include "common/refine/cell_partition.h"

namespace fanstream {

ProgressiveMesh::ProgressiveMesh(std::shared_ptr<const AssetHead> head)
    : head_(std::move(head)),
      model_(head_->statistics),
      coding_(model_, head_->grid, head_->generation_count()),
      state_(FanState::from_base(head_->base, head_->base.places.size())),
      waiting_(head_->generation_count() + 2),
      refined_(head_->generation_count() + 1),
      vertex_count_(static_cast<std::uint32_t>(head_->base.places.size())) {}

void ProgressiveMesh::set_index(std::shared_ptr<const AssetIndex> index) {
  index_ = std::move(index);
  state_.resize(head_->vertex_count);
  state_.set_next_splits(index_->base_next_splits);
  cells_.resize(index_->cells.size());
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    cells_[c].segments.resize(index_->cells[c].segment_count);
    cells_[c].held.resize(index_->cells[c].segment_count);
  }
  std::vector<VertexId> all(vertex_count_);
  for (VertexId v = 0; v < vertex_count_; ++v) all[v] = v;
  if (head_->root_cell_count > 0) start_cells(all, 0, head_->root_cell_count, 0);
}

void ProgressiveMesh::start_cells(std::span<const VertexId> parent_vertices, std::uint32_t first, std::uint32_t count,
                                  std::uint32_t slab) {
  auto groups =
      partition_vertices({parent_vertices.begin(), parent_vertices.end()}, state_.vertices, head_->grid.unit(), count);
  for (std::uint32_t i = 0; i < count; ++i) {
    Cell& cell = cells_[first + i];
    const CellEntry& entry = index_->cells[first + i];
    cell.vertices = {first + i, std::move(groups[i]), entry.first_vertex, 0, entry.split_count};
    state_.set_cell(first + i, cell.vertices.initial);
    cell.done = slab == 0 ? 0 : slab_end(slab - 1);
    cell.started = true;
    cell.undo.reserve(entry.split_count);
    enqueue(first + i);
  }
}

std::uint32_t ProgressiveMesh::layer_of(std::uint32_t generation) const {
  const auto& ends = head_->layer_ends;
  return static_cast<std::uint32_t>(std::lower_bound(ends.begin(), ends.end(), generation) - ends.begin());
}

bool ProgressiveMesh::next_segment_held(std::uint32_t cell_number) const {
  const Cell& cell = cells_[cell_number];
  const CellEntry& entry = index_->cells[cell_number];
  if (!cell.started || cell.done == slab_end(entry.slab)) return false;
  const std::uint32_t segment = layer_of(cell.done + 1) - head_->layer_begin(entry.slab);
  return cell.held[segment] || index_->segments[entry.first_segment + segment].size_bytes == 0;
}

// A cell waits under its next generation as soon as it holds the segment.
void ProgressiveMesh::enqueue(std::uint32_t cell_number) {
  if (next_segment_held(cell_number)) waiting_[cells_[cell_number].done + 1].push_back(cell_number);
}

bool ProgressiveMesh::holds(std::uint32_t cell, std::uint32_t segment) const { return cells_[cell].held[segment]; }

Result<void> ProgressiveMesh::add_segment(std::uint32_t cell_number, std::uint32_t segment,
                                          std::span<const std::byte> bytes) {
  const auto where = [&] { return "cell " + std::to_string(cell_number) + " segment " + std::to_string(segment); };
  if (!index_ || cell_number >= cells_.size() || segment >= cells_[cell_number].held.size()) {
    return fail(ErrorKind::bad_input, where() + " does not exist in this asset");
  }
  const CellEntry& entry = index_->cells[cell_number];
  const SegmentEntry& expected = index_->segments[entry.first_segment + segment];
  if (bytes.size() != expected.size_bytes) {
    return fail(ErrorKind::bad_input, where() + ": " + std::to_string(bytes.size()) + " bytes, the cell table says " +
                                          std::to_string(expected.size_bytes));
  }
  if (bytes.empty()) return {};
  Cell& cell = cells_[cell_number];
  if (cell.held[segment]) return {};
  cell.segments[segment].assign(bytes.begin(), bytes.end());
  cell.held[segment] = true;
  const bool wanted_now =
      cell.started && cell.done + 1 == head_->first_generation(head_->layer_begin(entry.slab) + segment);
  if (wanted_now) waiting_[cell.done + 1].push_back(cell_number);
  return {};
}

// Finds the roots of the next generation.
VertexId ProgressiveMesh::lagging_neighbour(const Cell& cell) {
  return find_roots(state_, cell.vertices, cell.done + 1, coding_);
}

// Decodes a generation's splits and looks whether they end where the segment and the cell do.
Result<void> ProgressiveMesh::decode_generation(Cell& cell, const CellEntry& entry, std::uint32_t generation) {
  const std::uint32_t layer = layer_of(generation);
  const std::uint32_t segment = layer - head_->layer_begin(entry.slab);
  const bool coded = entry.split_count != 0;
  if (coded) {
    if (generation == head_->first_generation(layer)) {
      cell.layer_starts.push_back(cell.decoder);
      cell.decoder.append(cell.segments[segment], index_->is_last_coded(entry, segment));
    }
    DecodedSplits source{cell.undo};
    if (Result<void> done = code_generation(state_, cell.vertices, generation, cell.decoder, source, coding_); !done)
      return done;
  }
  const bool starved = cell.decoder.starved();
  const bool layer_ends = coded && generation == head_->layer_ends[layer];
  const bool unfinished =
      layer_ends && !(generation == slab_end(entry.slab) ? cell.decoder.finished_cleanly() : cell.decoder.used_up());
  const bool incomplete = generation == slab_end(entry.slab) && cell.vertices.made != entry.split_count;
  if (!starved && !unfinished && !incomplete) return {};
  return fail(ErrorKind::bad_input, "cell " + std::to_string(cell.vertices.cell) + " segment " +
                                        std::to_string(segment) + ": its splits do not fill the segment");
}

Result<void> ProgressiveMesh::apply_generation(std::uint32_t cell_number) {
  Cell& cell = cells_[cell_number];
  const CellEntry& entry = index_->cells[cell_number];
  const std::uint32_t generation = cell.done + 1;
  const std::uint32_t before = cell.vertices.made;
  Result<void> decoded = decode_generation(cell, entry, generation);
  vertex_count_ += cell.vertices.made - before;
  if (!decoded) {
    roll_back(cell_number, before, generation);
    return decoded;
  }
  applied_ += cell.vertices.made - before;
  cell.made_before.push_back(before);
  cell.done = generation;
  refined_[generation].push_back(cell_number);
  if (generation == slab_end(entry.slab)) {
    complete_cell(cell, entry);
  } else if (generation == head_->layer_ends[layer_of(generation)]) {
    enqueue(cell_number);
  } else {
    waiting_[generation + 1].push_back(cell_number);
  }
  return {};
}

std::vector<VertexId> ProgressiveMesh::vertices_of(const Cell& cell) const {
  std::vector<VertexId> all(cell.vertices.count());
  for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = cell.vertices.at(i);
  return all;
}

void ProgressiveMesh::complete_cell(Cell& cell, const CellEntry& entry) {
  if (entry.child_count == 0) return;
  start_cells(vertices_of(cell), entry.first_child, entry.child_count, entry.slab + 1);
}

// Generation by generation over all cells, so that the mesh is equally fine everywhere when it has to stop.
Result<void> ProgressiveMesh::refine_evenly(std::uint32_t vertex_limit) {
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t generation = 1; generation < waiting_.size(); ++generation) {
      std::vector<std::uint32_t> cells;
      cells.swap(waiting_[generation]);
      for (const std::uint32_t c : cells) {
        if (vertex_count_ >= vertex_limit || lagging_neighbour(cells_[c]) != kOutside) {
          waiting_[generation].push_back(c);
          continue;
        }
        if (Result<void> applied = apply_generation(c); !applied) return applied;
        changed = true;
      }
    }
  }
  return {};
}

std::vector<std::uint32_t> ProgressiveMesh::take_waiting() {
  std::vector<std::uint32_t> cells;
  for (auto& list : waiting_) {
    cells.insert(cells.end(), list.begin(), list.end());
    list.clear();
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return cells;
}

// Cell by cell, each as far as it goes, then its children: while a piece of the surface is refined, it stays in the
// cache.
Result<void> ProgressiveMesh::refine_in_depth() {
  std::vector<std::uint32_t> stack = take_waiting();
  std::reverse(stack.begin(), stack.end());
  while (!stack.empty()) {
    const std::uint32_t c = stack.back();
    stack.pop_back();
    const CellEntry& entry = index_->cells[c];
    if (Result<void> advanced = advance(c, slab_end(entry.slab)); !advanced) return advanced;
    if (cells_[c].done != slab_end(entry.slab)) {
      enqueue(c);  // it waits on
      continue;
    }
    for (std::uint32_t i = entry.child_count; i-- > 0;) stack.push_back(entry.first_child + i);
  }
  for (const std::uint32_t c : take_waiting()) enqueue(c);  // once each, and only those that still wait
  return {};
}

// Takes a cell to a generation, or as far as held segments allow, and the cells beside it as far as that needs: they
// lag behind by a generation at least, so this is recursive at most as often as there are generations.
Result<void> ProgressiveMesh::advance(std::uint32_t cell_number, std::uint32_t generation) {
  Cell& cell = cells_[cell_number];
  while (cell.started && cell.done < generation && next_segment_held(cell_number)) {
    const VertexId w = lagging_neighbour(cell);
    if (w == kOutside) {
      if (Result<void> applied = apply_generation(cell_number); !applied) return applied;
      continue;
    }
    const std::uint32_t lagging = state_.cells[w];
    const std::uint32_t before = cells_[lagging].done;
    if (Result<void> advanced = advance(lagging, state_.vertices[w].context.next); !advanced) return advanced;
    if (cells_[lagging].done == before) break;  // else the vertex may have gone over to a child
  }
  return {};
}

Result<std::uint64_t> ProgressiveMesh::refine(std::uint32_t vertex_limit) {
  if (failed_) return fail(ErrorKind::bad_input, "refinement stopped at an earlier error");
  const std::uint64_t before = applied_;
  const bool everything = vertex_limit >= head_->vertex_count;
  if (Result<void> refined = everything ? refine_in_depth() : refine_evenly(vertex_limit); !refined) {
    failed_ = true;
    return tl::unexpected(refined.error());
  }
  return applied_ - before;
}

void ProgressiveMesh::retract_children(Cell& cell, std::uint32_t cell_number) {
  const CellEntry& entry = index_->cells[cell_number];
  for (std::uint32_t i = 0; i < entry.child_count; ++i) {
    Cell& child = cells_[entry.first_child + i];
    child.started = false;
    child.vertices = {};
    child.decoder = {};
    child.layer_starts.clear();
  }
  state_.set_cell(cell_number, vertices_of(cell));
}

void ProgressiveMesh::roll_back(std::uint32_t cell_number, std::uint32_t target, std::uint32_t generation) {
  Cell& cell = cells_[cell_number];
  vertex_count_ -= cell.vertices.made - target;
  while (cell.vertices.made > target) {
    --cell.vertices.made;
    undo_split(state_, generation, cell.undo.back(), cell.vertices.first_new + cell.vertices.made);
    cell.undo.pop_back();
  }
}

std::uint64_t ProgressiveMesh::undo_generation(std::uint32_t cell_number) {
  Cell& cell = cells_[cell_number];
  if (cell.done == slab_end(index_->cells[cell_number].slab)) retract_children(cell, cell_number);
  const std::uint32_t made = cell.vertices.made;
  roll_back(cell_number, cell.made_before.back(), cell.done);
  cell.made_before.pop_back();
  const std::uint32_t layer = layer_of(cell.done);
  if (cell.done == head_->first_generation(layer) && !cell.layer_starts.empty()) {
    cell.decoder = cell.layer_starts.back();
    cell.layer_starts.pop_back();
  }
  --cell.done;
  return made - cell.vertices.made;
}

std::uint64_t ProgressiveMesh::coarsen_to(std::uint32_t generation) {
  if (!index_) return 0;
  std::uint32_t border = 0;
  for (const std::uint8_t end : head_->layer_ends) {
    if (end <= generation) border = end;
  }
  std::uint64_t undone = 0;
  // In the opposite order: splits of one generation may be undone in any order unless damaged data made them overlap.
  for (std::uint32_t g = head_->generation_count(); g > border; --g) {
    for (; !refined_[g].empty(); refined_[g].pop_back()) undone += undo_generation(refined_[g].back());
  }
  for (auto& list : waiting_) list.clear();
  for (std::uint32_t c = 0; c < cells_.size(); ++c) enqueue(c);
  return undone;
}

std::uint32_t ProgressiveMesh::complete_generation() const {
  std::uint32_t least = head_->generation_count();
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    const Cell& cell = cells_[c];
    const bool leads_on = cell.done == slab_end(index_->cells[c].slab) && index_->cells[c].child_count > 0;
    if (cell.started && !leads_on) least = std::min(least, cell.done);
  }
  return cells_.empty() ? 0 : least;
}

namespace {

// By their smallest vertices, which stand first; ties by the next vertex. So equal meshes have their triangles in equal
// order.
std::vector<Triangle> in_order(const std::vector<Triangle>& triangles, std::size_t vertex_count) {
  std::vector<std::uint32_t> begin(vertex_count + 1, 0);
  for (const Triangle& t : triangles) ++begin[std::min({t[0], t[1], t[2]}) + 1];
  for (std::size_t v = 0; v < vertex_count; ++v) begin[v + 1] += begin[v];
  std::vector<Triangle> ordered(triangles.size());
  std::vector<std::uint32_t> fill(begin.begin(), begin.end() - 1);
  for (Triangle t : triangles) {
    while (t[0] > t[1] || t[0] > t[2]) t = {t[1], t[2], t[0]};
    ordered[fill[t[0]]++] = t;
  }
  for (std::size_t v = 0; v < vertex_count; ++v) std::sort(ordered.begin() + begin[v], ordered.begin() + begin[v + 1]);
  return ordered;
}

}  // namespace

TriangleMesh ProgressiveMesh::triangle_mesh() const {
  TriangleMesh mesh;
  std::vector<VertexId> number(state_.fans.vertex_capacity(), 0);
  mesh.positions.reserve(vertex_count_);
  for (VertexId v = 0; v < number.size(); ++v) {
    if (!state_.fans.contains(v)) continue;
    number[v] = static_cast<VertexId>(mesh.positions.size());
    mesh.positions.push_back(head_->grid.decode(state_.vertices[v].place));
  }
  std::vector<Triangle> triangles = state_.fans.triangles();
  for (Triangle& t : triangles) {
    for (VertexId& v : t) v = number[v];
  }
  mesh.triangles = in_order(triangles, mesh.positions.size());
  return mesh;
}

std::size_t ProgressiveMesh::memory_bytes() const {
  std::size_t bytes = state_.fans.memory_bytes() + state_.vertices.capacity() * sizeof(FanVertex) +
                      state_.cells.capacity() * sizeof(std::uint32_t) + cells_.capacity() * sizeof(Cell);
  for (const Cell& cell : cells_) {
    bytes += cell.vertices.initial.capacity() * sizeof(VertexId) + cell.undo.capacity() * sizeof(SplitUndo) +
             cell.made_before.capacity() * sizeof(std::uint32_t) +
             cell.layer_starts.capacity() * sizeof(RansDecoder);
    for (const auto& segment : cell.segments) bytes += segment.capacity();
  }
  for (const auto& cells : refined_) bytes += cells.capacity() * sizeof(std::uint32_t);
  return bytes;
}

}  // namespace fanstream
