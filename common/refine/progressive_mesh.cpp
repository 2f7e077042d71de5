#include "common/refine/progressive_mesh.h"

#include <algorithm>

#include "common/refine/cell_partition.h"
#include "common/refine/mesh_work.h"

namespace fanstream {

ProgressiveMesh::ProgressiveMesh(std::shared_ptr<const AssetHead> head, MeshMemory memory)
    : head_(std::move(head)),
      model_(head_->statistics),
      coding_(model_, head_->grid, head_->generation_count()),
      state_(FanState::from_base(head_->base, head_->base.places.size(), head_->precision)),
      vertex_count_(static_cast<std::uint32_t>(head_->base.places.size())),
      pages_(memory == MeshMemory::whole_model ? PageKind::huge : PageKind::small) {}

void ProgressiveMesh::set_index(std::shared_ptr<const AssetIndex> index) {
  index_ = std::move(index);
  held_ = HeldSegments(index_);
  state_.resize(head_->vertex_count, pages_);
  state_.set_next_splits(index_->base_next_splits);
  cells_.resize(index_->cells.size());
  std::vector<VertexId> all(vertex_count_);
  for (VertexId v = 0; v < vertex_count_; ++v) all[v] = v;
  if (head_->root_cell_count == 0) return;
  start_cells(all, 0, head_->root_cell_count, 0);
  if (!watched()) return;
  for (std::uint32_t c = 0; c < head_->root_cell_count; ++c) find_neighbours(c);
}

std::uint32_t ProgressiveMesh::slab_begin(std::uint32_t slab) const { return slab == 0 ? 0 : slab_end(slab - 1); }

std::uint32_t ProgressiveMesh::layer_of(std::uint32_t generation) const {
  const auto& ends = head_->layer_ends;
  return static_cast<std::uint32_t>(std::lower_bound(ends.begin(), ends.end(), generation) - ends.begin());
}

std::uint32_t ProgressiveMesh::segment_of(std::uint32_t cell, std::uint32_t generation) const {
  return layer_of(generation) - head_->layer_begin(index_->cells[cell].slab);
}

// --- Cells and which lie beside each other ---

void ProgressiveMesh::start_cells(std::span<const VertexId> parent_vertices, std::uint32_t first, std::uint32_t count,
                                  std::uint32_t slab) {
  auto groups = partition_vertices(parent_vertices, state_.vertices, head_->grid.unit(), count);
  for (std::uint32_t i = 0; i < count; ++i) {
    CellProgress& cell = cells_[first + i];
    const CellEntry& entry = index_->cells[first + i];
    cell.live = std::make_unique<LiveCell>();
    cell.live->vertices = {first + i, std::move(groups[i]), entry.first_vertex, 0, entry.split_count, {}};
    state_.set_cell(first + i, cell.live->vertices.initial);
    cell.done = static_cast<std::uint8_t>(slab_begin(slab));
    unfinished_.add(cell.done);
    update_limit(first + i);
    note_change(first + i);
  }
}

void ProgressiveMesh::find_neighbours(std::uint32_t cell_number) {
  LiveCell& cell = *cells_[cell_number].live;
  std::vector<std::uint32_t>& found = found_;
  found.clear();
  std::uint32_t latest = cell_number;
  for (std::uint32_t i = 0; i < cell.vertices.count(); ++i) {
    state_.fans.for_each_neighbour(cell.vertices.at(i), [&](VertexId w) {
      const std::uint32_t other = state_.cells[w];
      if (other == cell_number || other == latest) return;  // neighbours come in runs
      found.push_back(other);
      latest = other;
    });
  }
  std::sort(found.begin(), found.end());
  cell.neighbours.assign({found.begin(), std::unique(found.begin(), found.end())});
}

// The children of a complete cell take its place beside others. Splits change nothing about who is beside whom: each
// edge between two cells remains one, though from a root to the vertex that was split from it.
void ProgressiveMesh::hand_over_neighbours(std::uint32_t parent) {
  const CellEntry& entry = index_->cells[parent];
  const std::uint32_t end = entry.first_child + entry.child_count;
  note_neighbours_changed(parent);
  for (const std::uint32_t n : cells_[parent].live->neighbours)
    cells_[n].live->neighbours.erase_if([parent](std::uint32_t c) { return c == parent; });
  cells_[parent].live->neighbours = {};
  for (std::uint32_t child = entry.first_child; child < end; ++child) {
    find_neighbours(child);
    for (const std::uint32_t n : cells_[child].live->neighbours) {
      const bool sibling = n >= entry.first_child && n < end;
      if (!sibling) cells_[n].live->neighbours.push_back(child);
    }
  }
}

// The inverse.
void ProgressiveMesh::take_back_neighbours(std::uint32_t parent) {
  const CellEntry& entry = index_->cells[parent];
  const auto is_child = [&](std::uint32_t c) {
    return c >= entry.first_child && c < entry.first_child + entry.child_count;
  };
  std::vector<std::uint32_t> all;
  for (std::uint32_t i = 0; i < entry.child_count; ++i) {
    const auto& neighbours = cells_[entry.first_child + i].live->neighbours;
    std::copy_if(neighbours.begin(), neighbours.end(), std::back_inserter(all), [&](auto n) { return !is_child(n); });
  }
  std::sort(all.begin(), all.end());
  cells_[parent].live->neighbours.assign({all.begin(), std::unique(all.begin(), all.end())});
  for (const std::uint32_t n : cells_[parent].live->neighbours) {
    cells_[n].live->neighbours.erase_if(is_child);
    cells_[n].live->neighbours.push_back(parent);
  }
}

std::vector<VertexId> ProgressiveMesh::vertices_of(const LiveCell& cell) const {
  std::vector<VertexId> all(cell.vertices.count());
  for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = cell.vertices.at(i);
  return all;
}

void ProgressiveMesh::complete_cell(std::uint32_t cell_number) {
  LiveCell& cell = *cells_[cell_number].live;
  const CellEntry& entry = index_->cells[cell_number];
  if (entry.child_count == 0) return;
  start_cells(vertices_of(cell), entry.first_child, entry.child_count, entry.slab + 1);
  if (watched()) hand_over_neighbours(cell_number);
  cell.has_children = true;
}

void ProgressiveMesh::retract_children(std::uint32_t cell_number) {
  LiveCell& cell = *cells_[cell_number].live;
  const CellEntry& entry = index_->cells[cell_number];
  if (watched()) take_back_neighbours(cell_number);
  for (std::uint32_t i = 0; i < entry.child_count; ++i) {
    wake_waiting(entry.first_child + i);
    unfinished_.remove(cells_[entry.first_child + i].done);
    cells_[entry.first_child + i].live.reset();
    note_change(entry.first_child + i);
  }
  cell.has_children = false;
  state_.set_cell(cell_number, vertices_of(cell));
}

// --- Segments ---

// A cell is queued as soon as it may be able to take another generation.
void ProgressiveMesh::queue(std::uint32_t cell_number) {
  CellProgress& cell = cells_[cell_number];
  if (cell.queued || !can_advance(cell_number)) return;
  cell.queued = true;
  queue_.push_back(cell_number);
}

bool ProgressiveMesh::can_advance(std::uint32_t cell_number) const {
  const CellProgress& cell = cells_[cell_number];
  return cell.live && cell.done < cell.limit;
}

// After target, held segments or damage of the cell have changed.
void ProgressiveMesh::update_limit(std::uint32_t cell_number) {
  CellProgress& cell = cells_[cell_number];
  const std::uint32_t first_layer = head_->layer_begin(index_->cells[cell_number].slab);
  const auto generation_with = [&](std::uint32_t segments) {
    const std::uint32_t layer = first_layer + segments;
    std::uint32_t last = layer == 0 ? 0 : head_->layer_ends[layer - 1];
    if (cell.damaged != 0) last = std::min(last, cell.damaged - 1U);
    return static_cast<std::uint8_t>(last);
  };
  const std::uint32_t held = held_.prefix(cell_number);
  const std::uint8_t reach = generation_with(held);
  const bool further = reach > cell.reach;
  cell.reach = reach;
  cell.limit = generation_with(std::min(cell.target(), held));
  queue(cell_number);
  if (further && meaning_ == TargetMeaning::wanted && cell.live) wake_waiting(cell_number);
}

bool ProgressiveMesh::holds(std::uint32_t cell, std::uint32_t segment) const {
  if (index_->is_polygons(cell, segment)) return !polygons_.empty();
  if (segment == index_->cells[cell].segment_count) return index_->knows_children(cell);
  return index_->segments[index_->cells[cell].first_segment + segment].size_bytes != 0 && held_.holds(cell, segment);
}

Result<void> ProgressiveMesh::add_segment(std::uint32_t cell_number, std::uint32_t segment,
                                          std::span<const std::byte> bytes) {
  const auto where = [&] { return "cell " + std::to_string(cell_number) + " segment " + std::to_string(segment); };
  if (index_ && index_->is_polygons(cell_number, segment)) return keep_polygons(bytes);
  const bool exists = index_ && cell_number < cells_.size() && segment < index_->piece_count(cell_number);
  if (exists && index_->is_page(cell_number, segment)) return {};  // see learn_children
  if (!exists) {
    return fail(ErrorKind::bad_input, where() + " does not exist in this asset");
  }
  const CellEntry& entry = index_->cells[cell_number];
  const SegmentEntry& expected = index_->segments[entry.first_segment + segment];
  if (bytes.size() != expected.size_bytes) {
    return fail(ErrorKind::bad_input, where() + ": " + std::to_string(bytes.size()) + " bytes, the cell table says " +
                                          std::to_string(expected.size_bytes));
  }
  if (bytes.empty()) return {};
  if (held_.holds(cell_number, segment)) return {};
  held_.add(cell_number, segment, bytes);
  update_limit(cell_number);
  note_change(cell_number);
  return {};
}

Result<void> ProgressiveMesh::keep_polygons(std::span<const std::byte> bytes) {
  if (bytes.size() != index_->polygons.size_bytes) {
    return fail(ErrorKind::bad_input, "polygons: " + std::to_string(bytes.size()) + " bytes, the head says " +
                                          std::to_string(index_->polygons.size_bytes));
  }
  polygons_.assign(bytes.begin(), bytes.end());
  return {};
}

void ProgressiveMesh::learn_children(std::uint32_t parent) {
  const CellEntry& entry = index_->cells[parent];
  for (std::uint32_t child = entry.first_child; child < entry.first_child + entry.child_count; ++child) {
    held_.learn(child);
    if (!cells_[child].live) continue;
    CellVertices& vertices = cells_[child].live->vertices;
    vertices.first_new = index_->cells[child].first_vertex;
    vertices.most_new = index_->cells[child].split_count;
    update_limit(child);
    note_change(child);
  }
}

std::size_t ProgressiveMesh::release_segments(std::uint32_t cell_number, std::uint32_t keep) {
  CellProgress& cell = cells_[cell_number];
  const std::uint32_t slab = index_->cells[cell_number].slab;
  if (cell.live && cell.done > slab_begin(slab)) keep = std::max(keep, segment_of(cell_number, cell.done) + 1);
  if (cell.damaged != 0 && segment_of(cell_number, cell.damaged) >= keep) cell.damaged = 0;
  const std::size_t freed = held_.release(cell_number, keep);
  update_limit(cell_number);
  if (freed != 0) note_change(cell_number);
  return freed;
}

// --- One generation of a cell ---

CellToDecode ProgressiveMesh::start_decoding(const Step& step, std::uint32_t generation) {
  LiveCell& cell = *cells_[step.cell].live;
  const CellEntry& entry = index_->cells[step.cell];
  const std::uint32_t layer = layer_of(generation);
  const std::uint32_t segment = layer - head_->layer_begin(entry.slab);
  const std::span<const std::byte> bytes = held_.bytes(step.cell, segment);
  const bool begins = generation == head_->first_generation(layer);
  const bool ends = index_->is_last_coded(entry, segment);
  CellToDecode result;
  result.vertices = &cell.vertices;
  result.decoder = RansDecoder({cell.decoder.state, begins ? 0 : cell.decoder.position, cell.decoder.begun},
                               begins ? bytes.first(0) : bytes, ends);
  if (begins) result.decoder.append(bytes, ends);
  result.roots_begin = step.roots_begin;
  result.roots_end = step.roots_end;
  cell.vertices.make_room(state_, static_cast<std::uint32_t>(step.roots_end - step.roots_begin));
  return result;
}

// Whether a generation's splits end where the segment and the cell do.
Result<void> ProgressiveMesh::end_decoding(std::uint32_t cell_number, std::uint32_t generation,
                                           const RansDecoder& decoder) {
  LiveCell& cell = *cells_[cell_number].live;
  const CellEntry& entry = index_->cells[cell_number];
  if (entry.split_count == 0) return {};
  const std::uint32_t layer = layer_of(generation);
  const bool slab_ends = generation == slab_end(entry.slab);
  const bool unfinished =
      generation == head_->layer_ends[layer] && !(slab_ends ? decoder.finished_cleanly() : decoder.used_up());
  const bool incomplete = slab_ends && cell.vertices.made != entry.split_count;
  if (!decoder.starved() && !unfinished && !incomplete) {
    cell.decoder = decoder.mark();
    return {};
  }
  return fail(ErrorKind::bad_input, "cell " + std::to_string(cell_number) + " segment " +
                                        std::to_string(layer - head_->layer_begin(entry.slab)) +
                                        ": its splits do not fill the segment");
}

// A vertex that nobody is left to split would keep those beside it waiting for good.
Result<void> ProgressiveMesh::check_end(std::uint32_t cell_number) const {
  const CellEntry& entry = index_->cells[cell_number];
  if (entry.child_count != 0 || entry.slab + 1 == head_->slab_ends.size()) return {};
  const CellVertices& vertices = cells_[cell_number].live->vertices;
  for (std::uint32_t i = 0; i < vertices.count(); ++i) {
    if (state_.vertices[vertices.at(i)].context.next == kNeverSplit) continue;
    return fail(ErrorKind::bad_input,
                "cell " + std::to_string(cell_number) + ": its vertices are to be split, but it has no cells to do it");
  }
  return {};
}

// Of the cells of steps_.
void ProgressiveMesh::apply_generation(std::uint32_t generation, Work& work) {
  decoding_.clear();
  for (const Step& step : steps_) decoding_.push_back(start_decoding(step, generation));
  std::array<LiveCell::Generation, kMostSteps> before;
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    const LiveCell& cell = *cells_[steps_[i].cell].live;
    before[i] = {cell.vertices.made, cell.decoder};
  }
  decode_generation(state_, generation, decoding_, coding_);
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    Result<void> decoded = std::move(decoding_[i].result);
    if (decoded) decoded = end_decoding(steps_[i].cell, generation, decoding_[i].decoder);
    finish_generation(steps_[i].cell, before[i], std::move(decoded), work);
  }
}

// If the generation could not be decoded, the cell is as it was before.
void ProgressiveMesh::finish_generation(std::uint32_t cell_number, const LiveCell::Generation& before,
                                        Result<void> decoded, Work& work) {
  CellProgress& progress = cells_[cell_number];
  LiveCell& cell = *progress.live;
  const std::uint32_t generation = progress.done + 1U;
  const std::uint32_t end = slab_end(index_->cells[cell_number].slab);
  if (decoded && generation == end) decoded = check_end(cell_number);
  const std::uint32_t made = cell.vertices.made - before.made_before;
  vertex_count_ += made;
  if (!decoded) {
    roll_back(cell_number, before.made_before, generation);
    cell.decoder = before.decoder_before;
    progress.damaged = static_cast<std::uint8_t>(generation);
    update_limit(cell_number);
    work.move.damage.push_back({cell_number, segment_of(cell_number, generation), decoded.error()});
    return;
  }
  work.move.applied += made;
  if (cell.generations.empty()) cell.generations.reserve(end - progress.done);
  cell.generations.push_back(before);
  unfinished_.remove(progress.done);
  progress.done = static_cast<std::uint8_t>(generation);
  if (generation != end) unfinished_.add(progress.done);
  if (progress.done > progress.limit) excess_.push_back(cell_number);  // taken along: until it turns out what for
  note_change_around(cell_number);
  wake_waiting(cell_number);
  if (generation == end) complete_cell(cell_number);
}

void ProgressiveMesh::roll_back(std::uint32_t cell_number, std::uint32_t target, std::uint32_t generation) {
  CellVertices& vertices = cells_[cell_number].live->vertices;
  vertex_count_ -= vertices.made - target;
  while (vertices.made > target) {
    const VertexId added = vertices.made_at(vertices.made - 1);
    undo_split(state_, generation, kept_undo(state_, added), added);
    vertices.remove_last(state_);
  }
}

// --- What others see ---

void ProgressiveMesh::note_change(std::uint32_t cell_number) {
  if (!watched()) return;
  CellProgress& cell = cells_[cell_number];
  if (cell.changed) return;
  cell.changed = true;
  changed_.push_back(cell_number);
}

// Faces on the border are beside both cells. Who is beside the cell is found out when it is asked for, or when it gets
// children; cells that have come to be there since then have changed themselves.
void ProgressiveMesh::note_change_around(std::uint32_t cell_number) {
  note_change(cell_number);
  cells_[cell_number].changed_around = watched();
}

void ProgressiveMesh::note_neighbours_changed(std::uint32_t cell_number) {
  CellProgress& cell = cells_[cell_number];
  const bool noted = cell.changed_around;
  cell.changed_around = false;
  if (!noted || !cell.live) return;
  for (const std::uint32_t n : cell.live->neighbours) note_change(n);
}

std::vector<std::uint32_t> ProgressiveMesh::take_changed_cells() {
  for (std::size_t i = changed_.size(); i-- > 0;) note_neighbours_changed(changed_[i]);
  for (const std::uint32_t c : changed_) cells_[c].changed = false;
  return std::exchange(changed_, {});
}

CellBounds ProgressiveMesh::bounds(std::uint32_t cell) const {
  return cell_bounds(state_, cells_[cell].live->vertices, head_->grid, scratch_);
}

std::uint32_t ProgressiveMesh::applied_prefix(std::uint32_t cell) const {
  if (!cells_[cell].live) return 0;
  const std::uint32_t slab = index_->cells[cell].slab;
  std::uint32_t layer = head_->layer_begin(slab);
  while (layer < head_->slab_ends[slab] && head_->layer_ends[layer] <= cells_[cell].done) ++layer;
  return layer - head_->layer_begin(slab);
}

std::uint32_t ProgressiveMesh::begun_prefix(std::uint32_t cell) const {
  const std::uint32_t whole = applied_prefix(cell);
  if (!cells_[cell].live) return whole;
  const std::uint32_t layer = head_->layer_begin(index_->cells[cell].slab) + whole;
  const bool begun = layer < head_->layer_ends.size() && cells_[cell].done >= head_->first_generation(layer);
  return begun && whole < index_->cells[cell].segment_count ? whole + 1 : whole;
}

void ProgressiveMesh::find_blocking(std::uint32_t cell_number, std::vector<std::uint32_t>& found) const {
  found.clear();
  const CellProgress& cell = cells_[cell_number];
  const std::uint32_t end = slab_end(index_->cells[cell_number].slab);
  if (cell.done >= end) return;
  const std::uint32_t last = head_->layer_ends[layer_of(cell.done + 1U)];
  for (std::uint32_t i = 0; i < cell.live->vertices.count(); ++i) {
    const VertexId v = cell.live->vertices.at(i);
    const std::uint32_t next = state_.vertices[v].context.next;
    if (next > last) continue;
    state_.fans.for_each_neighbour(v, [&](VertexId w) {
      if (state_.vertices[w].context.next < next && state_.cells[w] != cell_number) found.push_back(state_.cells[w]);
    });
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
}

void ProgressiveMesh::find_supports(std::uint32_t cell_number, std::vector<Support>& found) const {
  found.clear();
  const CellProgress& cell = cells_[cell_number];
  const std::uint32_t begin = slab_begin(index_->cells[cell_number].slab);
  for (std::uint32_t i = 0; i < cell.live->vertices.count(); ++i) {
    const VertexId v = cell.live->vertices.at(i);
    const std::uint32_t own = state_.vertices[v].context.touched;
    if (own <= begin) continue;
    state_.fans.for_each_neighbour(v, [&](VertexId w) {
      const std::uint32_t before = state_.vertices[w].context.touched;
      if (before != 0 && before < own && state_.cells[w] != cell_number)
        found.push_back({own, state_.cells[w], before});
    });
  }
}

void ProgressiveMesh::find_needs(std::uint32_t cell_number, std::vector<Support>& found) const {
  found.clear();
  const CellProgress& cell = cells_[cell_number];
  const std::uint32_t end = slab_end(index_->cells[cell_number].slab);
  for (std::uint32_t i = 0; i < cell.live->vertices.count(); ++i) {
    const VertexId v = cell.live->vertices.at(i);
    const std::uint32_t own = state_.vertices[v].context.next;
    if (own > end) continue;
    state_.fans.for_each_neighbour(v, [&](VertexId w) {
      const std::uint32_t before = state_.vertices[w].context.next;
      if (before < own && state_.cells[w] != cell_number) found.push_back({own, state_.cells[w], before});
    });
  }
}

std::uint32_t ProgressiveMesh::complete_generation() const {
  std::uint32_t least = head_->generation_count();
  for (std::uint32_t c = 0; c < cells_.size(); ++c) {
    if (is_live(c)) least = std::min<std::uint32_t>(least, cells_[c].done);
  }
  return cells_.empty() ? 0 : least;
}

std::size_t ProgressiveMesh::memory_bytes() const {
  const auto array = [](const auto& values) { return values.capacity() * sizeof(values[0]); };
  std::size_t bytes = sizeof(*this) + state_.memory_bytes() + held_.memory_bytes() + array(cells_) + array(queue_) +
                      array(excess_) + array(changed_) + array(polygons_) + array(scratch_.points) +
                      array(scratch_.normals) + advancing_.memory_bytes() + array(blocked_) + array(steps_) +
                      array(decoding_) + array(found_);
  for (const CellProgress& cell : cells_) {
    if (cell.live) bytes += cell.live->memory_bytes();
  }
  return bytes;
}

}  // namespace fanstream
