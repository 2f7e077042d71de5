// ProgressiveMesh's ways from one mesh to another.
#include <algorithm>

#include "common/refine/mesh_work.h"
#include "common/refine/progressive_mesh.h"

namespace fanstream {

// --- Refining ---

// Puts the roots of the cell's next generation behind coding_.roots, and takes the cells beside it as far as that
// needs: they lag behind by a generation at least, so this is recursive at most as often as there are generations.
// Returns false where one does not get on; then the cell waits for it.
bool ProgressiveMesh::prepare_generation(std::uint32_t cell_number, Work& work) {
  const std::uint32_t generation = cells_[cell_number].done + 1U;
  const std::size_t first = coding_.root_count;
  add_roots(state_, cells_[cell_number].live->vertices, generation, coding_);
  go_around_roots(state_, coding_, first);
  for (std::size_t i = first; i < coding_.root_count; ++i) {
    for (;;) {
      const VertexId vertex = find_lagging(state_, generation, coding_.roots[i]);
      if (vertex == kOutside) break;
      const std::uint32_t lagging = state_.cells[vertex];
      const std::uint32_t before = cells_[lagging].done;
      const std::uint32_t reach = meaning_ == TargetMeaning::most ? cells_[lagging].limit : cells_[lagging].reach;
      if (work.in_step ||
          !advance(lagging, std::min<std::uint32_t>(reach, state_.vertices[vertex].context.next), work) ||
          cells_[lagging].done == before) {
        wait_for(cell_number, lagging);
        coding_.root_count = first;
        return false;
      }
      go_around_roots(state_, coding_, i);
    }
  }
  return true;
}

// Takes a cell to a generation that it can reach. Returns false at damage, or where it has to stop.
bool ProgressiveMesh::advance(std::uint32_t cell_number, std::uint32_t generation, Work& work) {
  const CellProgress& cell = cells_[cell_number];
  while (cell.live && cell.done < generation) {
    if (work.must_stop()) return false;
    const std::size_t first_root = coding_.root_count;
    if (!prepare_generation(cell_number, work)) return true;
    if (!apply_generation(cell_number, first_root, work)) return false;
    if (cell.done > cell.limit) excess_.push_back(cell_number);  // taken along: until it turns out what for
  }
  return true;
}

// Once only, however often it is tried.
void ProgressiveMesh::wait_for(std::uint32_t cell_number, std::uint32_t lagging) {
  CompactList<std::uint32_t>& waiting = cells_[lagging].live->waiting;
  if (std::find(waiting.begin(), waiting.end(), cell_number) == waiting.end()) waiting.push_back(cell_number);
}

// Where targets say what is wanted, a cell may wait for one that itself waits for others' sake only.
void ProgressiveMesh::wake_waiting(std::uint32_t cell_number) {
  for (const std::uint32_t c : std::exchange(cells_[cell_number].live->waiting, {})) {
    queue(c);
    const bool on_its_own = meaning_ == TargetMeaning::most || can_advance(c);
    if (!on_its_own && cells_[c].live) wake_waiting(c);
  }
}

// Cell by cell, each as far as it goes, then its children: while a piece of the surface is refined, it stays in the
// cache.
void ProgressiveMesh::refine_in_depth(Work& work) {
  std::vector<std::uint32_t> stack;
  for (;;) {
    stack.insert(stack.end(), queue_.rbegin(), queue_.rend());
    queue_.clear();
    if (stack.empty() || work.must_stop()) break;
    const std::uint32_t c = stack.back();
    stack.pop_back();
    cells_[c].queued = false;
    advance(c, cells_[c].limit, work);
    if (work.must_stop()) queue(c);
  }
  queue_.assign(stack.rbegin(), stack.rend());
}

// Generation by generation over all cells, so that the mesh is equally fine everywhere when it has to stop.
void ProgressiveMesh::refine_evenly(std::uint32_t vertex_limit, Work& work) {
  std::vector<std::vector<std::uint32_t>> by_generation(head_->generation_count() + 2U);
  const auto distribute = [&] {
    for (const std::uint32_t c : queue_) by_generation[cells_[c].done + 1U].push_back(c);
    queue_.clear();
  };
  distribute();
  std::vector<std::uint32_t> left;
  for (std::vector<std::uint32_t>& cells : by_generation) {
    std::sort(cells.begin(), cells.end());
    for (const std::uint32_t c : cells) {
      if (vertex_count_ >= vertex_limit || work.must_stop()) {
        left.push_back(c);
        continue;
      }
      cells_[c].queued = false;
      const std::size_t first_root = coding_.root_count;
      if (!can_advance(c) || !prepare_generation(c, work)) continue;
      if (apply_generation(c, first_root, work)) queue(c);
      distribute();  // all are for the next generation
    }
  }
  queue_ = std::move(left);
}

void ProgressiveMesh::drop_targets() {
  if (targets_set_) set_all_targets(kEverySegment);
  targets_set_ = false;
}

Result<std::uint64_t> ProgressiveMesh::refine(std::uint32_t vertex_limit) {
  if (failed_) return fail(ErrorKind::bad_input, "refinement stopped at an earlier error");
  drop_targets();
  Work work;
  work.stop_at_damage = true;
  std::sort(queue_.begin(), queue_.end());
  work.in_step = vertex_limit < head_->vertex_count;
  if (!work.in_step) {
    refine_in_depth(work);
  } else {
    refine_evenly(vertex_limit, work);
  }
  if (work.move.damage.empty()) return work.move.applied;
  failed_ = true;
  return tl::unexpected(work.move.damage.front().error);
}

// --- Coarsening ---

// A vertex beside the root or the new vertex of one of the cell's latest splits that was split or made after them.
VertexId ProgressiveMesh::find_later(std::uint32_t cell_number) const {
  const LiveCell& cell = *cells_[cell_number].live;
  const std::uint32_t generation = cells_[cell_number].done;
  VertexId later = kOutside;
  const auto look = [&](VertexId w) {
    if (state_.vertices[w].context.touched > generation) later = w;
  };
  for (std::uint32_t i = cell.generations.back().made_before; i < cell.vertices.made && later == kOutside; ++i) {
    const VertexId added = cell.vertices.made_at(i);
    state_.fans.for_each_neighbour(added, look);
    state_.fans.for_each_neighbour(kept_undo(state_, added).root, look);
  }
  return later;
}

// Undoes the last generation of a cell, and first what needs it: its children's, and those of cells beside it that were
// applied on top of it. What needs it is finer, so this is recursive at most as often as there are generations. Returns
// false where it has to stop before it is done.
bool ProgressiveMesh::undo_generation(std::uint32_t cell_number, Work& work) {
  CellProgress& progress = cells_[cell_number];
  LiveCell& cell = *progress.live;
  const CellEntry& entry = index_->cells[cell_number];
  const std::uint32_t generation = progress.done;
  if (cell.has_children) {
    for (std::uint32_t child = entry.first_child; child < entry.first_child + entry.child_count; ++child) {
      while (cells_[child].done > generation) {
        if (!undo_generation(child, work)) return false;
      }
    }
  }
  for (VertexId w = find_later(cell_number); w != kOutside; w = find_later(cell_number)) {
    std::uint32_t later = state_.cells[w];
    const CellEntry& of_later = index_->cells[later];
    if (cells_[later].done == slab_begin(of_later.slab)) later = of_later.parent;  // whose splits its finest are
    if (!undo_generation(later, work)) return false;
  }
  if (work.must_stop()) return false;
  if (cell.has_children) retract_children(cell_number);
  const LiveCell::Generation undo = cell.generations.back();
  cell.generations.pop_back();
  const std::uint32_t made = cell.vertices.made;
  roll_back(cell_number, undo.made_before, generation);
  work.move.undone += made - undo.made_before;
  cell.decoder = undo.decoder_before;
  progress.done = static_cast<std::uint8_t>(generation - 1);
  note_change_around(cell_number);
  queue(cell_number);
  return true;
}

void ProgressiveMesh::coarsen_excess(Work& work) {
  while (!excess_.empty()) {
    const std::uint32_t c = excess_.back();
    while (cells_[c].live && cells_[c].done > cells_[c].limit) {
      if (work.must_stop() || !undo_generation(c, work)) return;
    }
    excess_.pop_back();
  }
}

// Whether a cell that is to get on waits for this one, or waits for one that does. Who waits is finer, so this is
// recursive at most as often as there are generations.
bool ProgressiveMesh::is_awaited(std::uint32_t cell_number) const {
  const CellProgress& cell = cells_[cell_number];
  for (const std::uint32_t w : cell.live->waiting) {
    if (cells_[w].live && cells_[w].done > cell.done && (can_advance(w) || is_awaited(w))) return true;
  }
  return false;
}

// Whether a cell's last generation is part of what others, or its children, were applied on top of; or has brought the
// children that others wait for.
bool ProgressiveMesh::is_needed(std::uint32_t cell_number) const {
  const CellProgress& cell = cells_[cell_number];
  if (cell.live->has_children) {
    const CellEntry& entry = index_->cells[cell_number];
    for (std::uint32_t child = entry.first_child; child < entry.first_child + entry.child_count; ++child) {
      if (cells_[child].done > cell.done || is_awaited(child)) return true;
    }
  }
  return is_awaited(cell_number) || find_later(cell_number) != kOutside;
}

// After a cell has lost a generation: what that lay on belongs to cells beside it now, or to those they come from.
void ProgressiveMesh::note_less_needed(std::uint32_t cell_number) {
  const auto note = [&](std::uint32_t c) {
    if (cells_[c].done > cells_[c].limit) excess_.push_back(c);
    const CellEntry& entry = index_->cells[c];
    if (entry.slab > 0 && cells_[c].done == slab_begin(entry.slab) &&
        cells_[entry.parent].done > cells_[entry.parent].limit) {
      excess_.push_back(entry.parent);
    }
  };
  note(cell_number);
  for (const std::uint32_t n : cells_[cell_number].live->neighbours) note(n);
}

// Generation by generation, as far as nothing that stays was applied on top of it.
void ProgressiveMesh::coarsen_unneeded(Work& work) {
  while (!excess_.empty()) {
    const std::uint32_t c = excess_.back();
    const CellProgress& cell = cells_[c];
    if (!cell.live || cell.done <= cell.limit || is_needed(c)) {
      excess_.pop_back();
      continue;
    }
    if (!undo_generation(c, work)) return;
    note_less_needed(c);
  }
}

std::uint64_t ProgressiveMesh::coarsen_to(std::uint32_t generation) {
  if (!index_) return 0;
  std::uint32_t border = 0;
  for (const std::uint8_t end : head_->layer_ends) {
    if (end <= generation) border = end;
  }
  Work work;
  for (std::uint32_t c = 0; c < cells_.size(); ++c) {
    while (cells_[c].live && cells_[c].done > std::max(border, slab_begin(index_->cells[c].slab))) {
      undo_generation(c, work);
    }
  }
  state_.give_back_pages();
  return work.move.undone;
}

// --- Moving ---

void ProgressiveMesh::set_all_targets(std::uint32_t segments) {
  targets_set_ = true;
  for (std::uint32_t c = 0; c < cells_.size(); ++c) {
    if (cells_[c].target() == segments) continue;
    cells_[c].set_target(segments);
    update_limit(c);
    if (cells_[c].live && cells_[c].done > cells_[c].limit) excess_.push_back(c);
  }
}

MeshMove ProgressiveMesh::move_to(std::span<const CellTarget> targets, std::uint64_t split_budget) {
  targets_set_ = true;
  for (const CellTarget& t : targets) {
    CellProgress& cell = cells_[t.cell];
    cell.set_target(t.segments);
    update_limit(t.cell);
    if (cell.live && cell.done > cell.limit) excess_.push_back(t.cell);
  }
  Work work;
  work.split_budget = split_budget;
  if (meaning_ == TargetMeaning::most) {
    coarsen_excess(work);
    if (excess_.empty()) refine_in_depth(work);
  } else {
    refine_in_depth(work);
    coarsen_unneeded(work);
  }
  state_.give_back_pages();
  work.move.finished = excess_.empty() && queue_.empty();
  return std::move(work.move);
}

}  // namespace fanstream
