// ProgressiveMesh's ways from one mesh to another.
#include <algorithm>

#include "common/refine/mesh_work.h"
#include "common/refine/progressive_mesh.h"

namespace fanstream {

namespace {

constexpr std::uint32_t kNoCell = std::numeric_limits<std::uint32_t>::max();

}  // namespace

// --- Refining ---

void ProgressiveMesh::set_goal(std::uint32_t cell_number, std::uint32_t generation) {
  CellProgress& cell = cells_[cell_number];
  if (cell.goal == 0) advancing_.push(cell_number, cell.done + 1U);
  cell.goal = std::max(cell.goal, static_cast<std::uint8_t>(generation));
}

// Takes cells to their goals, or as far as they get: always those that are the coarsest, as many at once as can be, so
// that many splits are decoded side by side. What lags behind beside them gets goals of its own, which are coarser.
void ProgressiveMesh::advance(Work& work) {
  while (!advancing_.empty() && !work.must_stop()) take_step(work);
  for (; !advancing_.empty(); advancing_.pop()) cells_[advancing_.front()].goal = 0;
  for (const std::uint32_t c : blocked_) cells_[c].blocked = false;
  blocked_.clear();
}

std::uint32_t ProgressiveMesh::most_splits_left(std::uint32_t cell_number) const {
  const CellVertices& vertices = cells_[cell_number].live->vertices;
  return vertices.most_new - vertices.made;
}

// Asks for what the next steps need, stage by stage along the pointers to it: between two generations of a cell all
// others have theirs, and little of it is left in the caches.
void ProgressiveMesh::fetch_ahead() const {
  const std::size_t count = advancing_.empty() ? 0 : advancing_.in_line();
  const auto for_step = [&](std::size_t ahead, auto&& fetch) {
    for (std::size_t i = ahead * kMostSteps; i < std::min(count, (ahead + 1) * kMostSteps); ++i) {
      fetch(advancing_.at(i));
    }
  };
  for_step(2, [&](std::uint32_t c) {
    fetch_lines(cells_[c].live.get(), sizeof(LiveCell));
    fetch_line(&index_->cells[c]);
  });
  for_step(1, [&](std::uint32_t c) {
    cells_[c].live->vertices.fetch();
    fetch_line(cells_[c].live->generations.data());
    fetch_line(&index_->segments[index_->cells[c].first_segment]);
    held_.fetch(c);
  });
  for_step(0, [&](std::uint32_t c) { cells_[c].live->vertices.fetch_vertices(state_); });
}

// Of those that are the coarsest and can take their next generation: one, or as many as stay within the budget.
void ProgressiveMesh::take_step(Work& work) {
  const std::uint32_t generation = advancing_.generation();
  steps_.clear();
  coding_.root_count = 0;
  std::uint64_t budget = work.split_budget - (work.move.applied + work.move.undone);
  while (!advancing_.empty() && advancing_.generation() == generation && steps_.size() < kMostSteps) {
    const std::uint32_t c = advancing_.front();
    const std::uint32_t splits = most_splits_left(c);
    if (!steps_.empty() && splits > budget) break;
    budget -= std::min<std::uint64_t>(budget, splits);
    advancing_.pop();
    const std::size_t begin = coding_.root_count;
    add_roots(state_, cells_[c].live->vertices, generation, coding_);
    steps_.push_back({c, begin, coding_.root_count});
  }
  fetch_ahead();
  go_around_roots(state_, coding_, 0);
  const bool none_lags = !unfinished_.any_before(generation - 1);
  std::size_t ready = 0;
  for (const Step& step : steps_) {
    CellProgress& cell = cells_[step.cell];
    if (none_lags || is_ready(step, generation, work)) {
      steps_[ready++] = step;
    } else if (cell.blocked) {
      cell.goal = 0;
    } else {
      advancing_.push(step.cell, generation);
    }
  }
  steps_.resize(ready);
  apply_generation(generation, work);
  for (const Step& step : steps_) {
    CellProgress& cell = cells_[step.cell];
    cell.goal = std::min(cell.goal, cell.reach);
    if (cell.done < cell.goal) {
      advancing_.push(step.cell, cell.done + 1U);
    } else {
      cell.goal = 0;
    }
  }
}

// Whether nothing around the roots lags behind. What does is asked for; if one does not get on, the cell waits for it.
bool ProgressiveMesh::is_ready(const Step& step, std::uint32_t generation, const Work& work) {
  bool ready = true;
  for (std::size_t i = step.roots_begin; i < step.roots_end; ++i) {
    if (!lags(state_, generation, coding_.roots[i])) [[likely]]
      continue;
    ready = false;
    std::uint32_t stuck = kNoCell;
    state_.fans.for_each_neighbour(coding_.roots[i].vertex, [&](VertexId w) {
      const std::uint32_t next = state_.vertices[w].context.next;
      if (next < generation && !ask_for(state_.cells[w], next, work)) stuck = state_.cells[w];
    });
    if (stuck == kNoCell) continue;
    wait_for(step.cell, stuck);
    cells_[step.cell].blocked = true;
    blocked_.push_back(step.cell);
    return false;
  }
  return ready;
}

// Returns false if the cell does not get on.
bool ProgressiveMesh::ask_for(std::uint32_t lagging, std::uint32_t generation, const Work& work) {
  CellProgress& cell = cells_[lagging];
  const std::uint32_t reach = meaning_ == TargetMeaning::most ? cell.limit : cell.reach;
  if (work.in_step || cell.blocked || cell.done >= std::min(reach, generation)) return false;
  set_goal(lagging, std::min(reach, generation));
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

// All cells that can, but no more of them than the budget may allow, as far as they go; then their children.
void ProgressiveMesh::refine_queued(Work& work) {
  std::vector<std::uint32_t> stack;
  std::vector<std::uint32_t> together;
  for (;;) {
    stack.insert(stack.end(), queue_.rbegin(), queue_.rend());
    queue_.clear();
    if (stack.empty() || work.must_stop()) break;
    together.clear();
    std::uint64_t budget = work.split_budget - (work.move.applied + work.move.undone);
    while (!stack.empty()) {
      const std::uint32_t c = stack.back();
      const std::uint64_t splits = can_advance(c) ? most_splits_left(c) : 0;
      if (!together.empty() && splits > budget) break;
      budget -= std::min(budget, splits);
      stack.pop_back();
      cells_[c].queued = false;
      if (!can_advance(c)) continue;
      together.push_back(c);
      set_goal(c, cells_[c].limit);
    }
    advance(work);
    if (!work.must_stop()) continue;
    for (const std::uint32_t c : together) queue(c);
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
      if (!can_advance(c)) continue;
      const std::uint32_t before = cells_[c].done;
      set_goal(c, before + 1);
      advance(work);
      if (cells_[c].done > before) queue(c);
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
    refine_queued(work);
  } else {
    refine_evenly(vertex_limit, work);
  }
  if (work.move.damage.empty()) return work.move.applied;
  failed_ = true;
  return tl::unexpected(work.move.damage.front().error);
}

// --- Coarsening ---

// A vertex beside the root or the new vertex of one of the cell's latest splits, from split number `from` on, that was
// split or made after them; moves `from` on to that split.
VertexId ProgressiveMesh::find_later(std::uint32_t cell_number, std::uint32_t& from) const {
  const LiveCell& cell = *cells_[cell_number].live;
  const std::uint32_t generation = cells_[cell_number].done;
  VertexId later = kOutside;
  const auto look = [&](VertexId w) {
    if (state_.vertices[w].context.touched > generation) later = w;
  };
  for (; from < cell.vertices.made; ++from) {
    const VertexId added = cell.vertices.made_at(from);
    state_.fans.for_each_neighbour(added, look);
    state_.fans.for_each_neighbour(kept_undo(state_, added).root, look);
    if (later != kOutside) break;
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
  std::uint32_t looked_at = cell.generations.back().made_before;
  for (VertexId w = find_later(cell_number, looked_at); w != kOutside; w = find_later(cell_number, looked_at)) {
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
  if (generation != slab_end(entry.slab)) unfinished_.remove(generation);
  progress.done = static_cast<std::uint8_t>(generation - 1);
  unfinished_.add(progress.done);
  note_change_around(cell_number);
  queue(cell_number);
  return true;
}

// Asks for what undoing the next cells of excess_ needs.
void ProgressiveMesh::fetch_excess() const {
  const auto live = [&](std::size_t ahead) {
    return ahead < excess_.size() ? cells_[excess_[excess_.size() - 1 - ahead]].live.get() : nullptr;
  };
  if (const LiveCell* cell = live(6)) fetch_lines(cell, sizeof *cell);
  if (const LiveCell* cell = live(4)) cell->vertices.fetch();
  if (const LiveCell* cell = live(2)) cell->vertices.fetch_vertices(state_);
}

void ProgressiveMesh::coarsen_excess(Work& work) {
  while (!excess_.empty()) {
    fetch_excess();
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
  std::uint32_t first = cell.live->generations.back().made_before;
  return is_awaited(cell_number) || find_later(cell_number, first) != kOutside;
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
    fetch_excess();
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
    if (excess_.empty()) refine_queued(work);
  } else {
    refine_queued(work);
    coarsen_unneeded(work);
  }
  state_.give_back_pages();
  work.move.finished = excess_.empty() && queue_.empty();
  return std::move(work.move);
}

}  // namespace fanstream
