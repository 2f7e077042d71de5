#include "client/session/view_model.h"

#include <algorithm>
#include <glm/geometric.hpp>

#include "client/view/asset_cells.h"
#include "client/view/extent_parts.h"
#include "common/support/free_memory.h"

namespace fanstream {
ViewModel::ViewModel(std::shared_ptr<const AssetHead> head) : mesh_(std::move(head), MeshMemory::live_part) {}

Result<void> ViewModel::set_index(AssetIndex index, const std::string& name) {
  std::vector<std::uint64_t>().swap(index.segment_offsets);  // the file is the server's
  Result<CellTable> table = cell_table_of(mesh_.head(), index, name);
  if (!table) return tl::unexpected(table.error());
  table_ = std::move(*table);
  targets_.assign(index.cells.size(), 0);
  index_ = std::make_shared<AssetIndex>(std::move(index));
  mesh_.set_index(index_);
  const std::size_t owners =
      index_->has_page(index_->first_page_owner) ? index_->first_paged - index_->first_page_owner : 0;
  closed_pages_.assign(owners, false);
  mesh_.set_all_targets(0);
  planner_ = std::make_unique<Planner>(table_);
  give_back_free_memory();  // reading head and index took much that is not kept
  return {};
}

Result<void> ViewModel::add_segment(std::uint32_t cell, std::uint32_t segment, std::span<const std::byte> bytes) {
  const bool page = index_ && cell < index_->cells.size() && segment == index_->cells[cell].segment_count;
  return page ? add_page(cell, bytes) : mesh_.add_segment(cell, segment, bytes);
}

Result<void> ViewModel::add_page(std::uint32_t cell, std::span<const std::byte> bytes) {
  const bool known = index_->has_page(cell) && index_->knows_children(cell);
  if (Result<void> read = read_page(bytes, cell, mesh_.head(), *index_, "the cell table"); !read || known) return read;
  mesh_.learn_children(cell);
  learn_children(mesh_.head(), *index_, cell, table_);
  update_prefixes(cell);
  return {};
}

// A page that is known counts as held with the segment before it, and as applied where it is open.
void ViewModel::update_prefixes(std::uint32_t cell) {
  const std::uint32_t segments = index_->cells[cell].segment_count;
  const bool page = index_->has_page(cell) && index_->knows_children(cell);
  const bool open = page && !closed_pages_[cell - index_->first_page_owner];
  const std::uint32_t held = mesh_.held_prefix(cell);
  const std::uint32_t applied = mesh_.applied_prefix(cell);
  table_.set_held(cell, page && held == segments ? held + 1 : held);
  if (open && applied == segments) {
    table_.set_applied(cell, applied + 1);
  } else {
    table_.set_applied(cell, applied, mesh_.begun_prefix(cell));
  }
}

// Around all that the cell has ever covered, and as far around it as the original may be: so it holds the cell's part
// of the original whatever comes, and comes to rest.
void ViewModel::update_extent(std::uint32_t cell) {
  const CellBounds bounds = mesh_.bounds(cell);
  if (bounds.radius < 0.0) return;
  const CellEntry& entry = mesh_.index().cells[cell];
  const double margin = table_.error_at(cell, table_.applied(cell));
  CellExtent extent{bounds.centre, bounds.radius + margin, glm::dvec3(entry.cone.axis()), entry.cone.cosine()};
  const std::span<glm::dvec3> corners = mesh_.bounded_corners();
  if (!table_.extent_known(cell)) {
    table_.set_extent(cell, extent, parts_around(corners, margin));
    return;
  }
  const CellExtent before = table_.extent(cell);
  extent.center = before.center;
  extent.radius = before.radius;
  table_.copy_parts(cell, parts_);
  const bool grown = enclose(extent.center, extent.radius, bounds.centre, bounds.radius + margin);
  if (widen(parts_, corners, margin) || grown) table_.set_extent(cell, extent, parts_);
}

// In generations of the cells' own slabs. The other cell is the one among those that it comes from that took the
// generation, or the one whose descendant will take it: then all of it is needed.
Dependency ViewModel::dependency_of(std::uint32_t cell, const ProgressiveMesh::Support& found) const {
  const AssetHead& head = mesh_.head();
  const auto begin = [&](std::uint32_t c) { return head.first_generation(head.layer_begin(table_.slab_of(c))); };
  std::uint32_t other = found.cell;
  while (table_.slab_of(other) > 0 && begin(other) > found.on) other = table_.parent(other);
  const std::uint32_t most = table_.generations_of(table_.slab_of(other));
  return {found.generation + 1 - begin(cell), other, std::min(most, found.on + 1 - begin(other))};
}

// What stays in the cell, or is its parent's, goes without saying.
void ViewModel::update_dependencies(std::uint32_t cell) {
  const auto gather = [&] {
    dependencies_.clear();
    for (const ProgressiveMesh::Support& s : found_) {
      const Dependency d = dependency_of(cell, s);
      if (d.cell != cell && d.cell != table_.parent(cell)) dependencies_.push_back(d);
    }
  };
  mesh_.find_supports(cell, found_);
  gather();
  table_.set_supports(cell, dependencies_);
  mesh_.find_needs(cell, found_);
  gather();
  table_.add_needs(cell, dependencies_);
}

void ViewModel::update_table() {
  for (const std::uint32_t c : mesh_.take_changed_cells()) {
    update_prefixes(c);
    if (!mesh_.is_live(c)) continue;
    update_extent(c);
    update_dependencies(c);
  }
}

const Plan& ViewModel::plan(const View& view, const PlanOptions& options) {
  update_table();
  plan_ = &planner_->plan(view, options);
  // What is open or not follows from the plan, and the plan from that: opening one never closes another.
  for (int round = 0; round < 4 && follow_pages(); ++round) plan_ = &planner_->plan(view, options);
  return *plan_;
}

// Known pages are closed where the plan does without their cells, and none of these has begun; then the parent counts
// as what is drawn. True if any has changed.
bool ViewModel::follow_pages() {
  bool changed = false;
  for (std::size_t i = 0; i < closed_pages_.size(); ++i) {
    const auto cell = static_cast<std::uint32_t>(index_->first_page_owner + i);
    const CellEntry& entry = index_->cells[cell];
    if (!index_->knows_children(cell)) continue;
    bool closed = plan_->targets[cell] <= entry.segment_count;
    for (std::uint32_t child = entry.first_child; closed && child < entry.first_child + entry.child_count; ++child) {
      closed = table_.begun(child) == 0;
    }
    if (closed == closed_pages_[i]) continue;
    closed_pages_[i] = closed;
    update_prefixes(cell);
    changed = true;
  }
  return changed;
}

std::vector<CellRun> ViewModel::wants() const {
  std::vector<CellPrefix> list;
  list.reserve(plan_->wants.size());
  for (const Want& want : plan_->wants) list.push_back({want.cell, want.prefix});
  if (wants_polygons()) list.push_back({mesh_.index().polygon_cell(), 1});
  return to_runs(list);
}

MeshMove ViewModel::apply(std::uint64_t split_budget) {
  std::vector<CellTarget> changed;
  for (std::uint32_t c = 0; c < targets_.size(); ++c) {
    if (targets_[c] == plan_->targets[c]) continue;
    targets_[c] = plan_->targets[c];
    changed.push_back({c, targets_[c]});
  }
  return mesh_.move_to(changed, split_budget);
}

std::vector<CellRun> ViewModel::evict() {
  std::vector<CellPrefix> released;
  for (const Eviction& eviction : plan_->evictions) {
    if (mesh_.release_segments(eviction.cell, eviction.keep_prefix) == 0) continue;
    released.push_back({eviction.cell, mesh_.held_prefix(eviction.cell)});
  }
  return to_runs(released);
}

}  // namespace fanstream
