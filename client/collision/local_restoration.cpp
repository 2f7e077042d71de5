#include "client/collision/local_restoration.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace fanstream {
namespace {

constexpr std::uint32_t kAll = ProgressiveMesh::kEverySegment;

Bounds cube(const glm::dvec3& centre, double half_side) { return {centre - half_side, centre + half_side}; }

CellHierarchy hierarchy_of(ProgressiveMesh& mesh, std::shared_ptr<const AssetIndex> index) {
  mesh.set_index(std::move(index));
  return {mesh.head(), mesh.index()};
}

}  // namespace

LocalRestoration::LocalRestoration(std::shared_ptr<const AssetHead> head, std::shared_ptr<const AssetIndex> index)
    : mesh_(std::move(head), MeshMemory::live_part),
      cells_(hierarchy_of(mesh_, std::move(index))),
      surface_(mesh_, cells_),
      places_(cells_, surface_.frame()),
      outside_(mesh_.index().cells.size(), 0),
      last_found_(mesh_.index().cells.size(), 0),
      place_in_found_(mesh_.index().cells.size(), 0),
      place_of_step_(mesh_.index().segments.size(), kNoBounds) {
  mesh_.set_target_meaning(TargetMeaning::wanted);
  mesh_.set_all_targets(0);
  const std::vector<std::uint32_t> changed = mesh_.take_changed_cells();
  surface_.update(changed);
  note_places(changed);
}

Result<void> LocalRestoration::add_segment(std::uint32_t cell, std::uint32_t segment,
                                           std::span<const std::byte> bytes) {
  return mesh_.add_segment(cell, segment, bytes);
}

// --- Where cells lie ---

bool LocalRestoration::lacks_splits(std::uint32_t cell) const {
  return mesh_.applied_prefix(cell) < mesh_.index().cells[cell].segment_count;
}

double LocalRestoration::error_now(std::uint32_t cell) const {
  const CellEntry& entry = mesh_.index().cells[cell];
  const std::uint32_t applied = mesh_.applied_prefix(cell);
  if (applied >= entry.segment_count) return 0.0;
  return error_from_code(mesh_.index().segments[entry.first_segment + applied].error_code, mesh_.head().grid.step());
}

// A triangle that is not in the mesh is represented by faces around vertices that lack splits, no farther off than
// their cells' errors.
void LocalRestoration::note_places(std::span<const std::uint32_t> changed_cells) {
  for (const std::uint32_t c : changed_cells) {
    if (!mesh_.is_live(c) || !lacks_splits(c)) continue;
    const CellBounds& bounds = mesh_.bounds(c);
    if (bounds.radius < 0.0) continue;
    const Bounds place = cube(bounds.centre, (bounds.radius + error_now(c)) * (1.0 + 1e-12));
    Bounds& here = place_of_step_[mesh_.index().cells[c].first_segment + mesh_.applied_prefix(c)];
    here = united(here, place);
    places_.widen(c, place);
  }
}

// Around all faces that have one of a live cell's vertices as a corner.
Bounds LocalRestoration::box_of_faces(std::uint32_t cell) const {
  const FanState& state = mesh_.state();
  const CellVertices& vertices = mesh_.vertices(cell);
  Bounds box = kNoBounds;
  const auto include = [&](VertexId v) {
    const glm::dvec3 p = mesh_.head().grid.decode(state.vertices[v].place);
    box = united(box, {p, p});
  };
  for (std::uint32_t i = 0; i < vertices.count(); ++i) {
    include(vertices.at(i));
    state.fans.for_each_neighbour(vertices.at(i), include);
  }
  return box;
}

Result<void> LocalRestoration::measure() {
  if (measured_) return {};
  mesh_.set_all_targets(kAll);
  const MeshMove move = mesh_.move_to({});
  const bool complete = mesh_.is_complete();
  if (complete) {
    places_.clear();
    for (std::uint32_t c = 0; c < outside_.size(); ++c) {
      if (mesh_.is_live(c)) places_.widen(c, box_of_faces(c));
    }
    place_of_step_ = {};
    measured_ = true;
  }
  mesh_.set_all_targets(0);
  in_focus_.clear();
  ++searches_;
  for (std::uint32_t c = 0; c < outside_.size(); ++c) {
    if (outside_[c] != 0) changes_.push_back({c, outside_[c]});
  }
  (void)mesh_.move_to({});
  const std::vector<std::uint32_t> changed = mesh_.take_changed_cells();
  surface_.update(changed);
  if (complete) return {};
  if (!move.damage.empty()) return tl::unexpected(move.damage.front().error);
  return fail(ErrorKind::usage, "the model cannot be measured: not all of its segments are held");
}

// --- Moving ---

void LocalRestoration::set_coarseness(double error) {
  assert(error >= 0.0);
  const AssetIndex& index = mesh_.index();
  for (std::uint32_t c = 0; c < outside_.size(); ++c) {
    const CellEntry& entry = index.cells[c];
    std::uint32_t segments = 0;
    while (segments < entry.segment_count && error_from_code(index.segments[entry.first_segment + segments].error_code,
                                                             mesh_.head().grid.step()) > error) {
      ++segments;
    }
    outside_[c] = error == 0.0 ? kAll : segments;
  }
  // Cells that are in focus keep their targets.
  for (std::uint32_t c = 0; c < outside_.size(); ++c) {
    if (last_found_[c] != searches_) changes_.push_back({c, outside_[c]});
  }
}

// How many of a cell's segments a focus needs that touches its place. Before the model is measured: one more than it
// had whenever its place, as it was then, is known to be touched.
std::uint32_t LocalRestoration::needed_segments(std::uint32_t cell, const FocusTest& test) const {
  if (measured_) return kAll;
  const CellEntry& entry = mesh_.index().cells[cell];
  for (std::uint32_t p = entry.segment_count; p > 0; --p) {
    const Bounds& place = place_of_step_[entry.first_segment + p - 1];
    if (place.low.x <= place.high.x && test.may_touch(place)) return p == entry.segment_count ? kAll : p;
  }
  return 0;
}

void LocalRestoration::find_cells(const FocusTest& test, std::vector<CellTarget>& found) {
  found.clear();
  if (test.is_empty()) return;
  places_.find(test, [&](std::uint32_t c) {
    // A cell's cone holds its children's too.
    if (!test.may_hold(mesh_.index().cells[c].cone)) return false;
    place_in_found_[c] = static_cast<std::uint32_t>(found.size());
    found.push_back({c, needed_segments(c, test)});
    return true;
  });
  if (measured_) return;
  // What a cell needs it only gets if the cell that it comes from is complete. That one was found before.
  for (std::size_t i = found.size(); i-- > 0;) {
    const std::uint32_t parent = mesh_.index().cells[found[i].cell].parent;
    if (found[i].segments > 0 && parent != CellHierarchy::kNone) found[place_in_found_[parent]].segments = kAll;
  }
}

void LocalRestoration::change_targets(const std::vector<CellTarget>& in_focus) {
  ++searches_;
  const bool pending = !changes_.empty();
  for (const CellTarget& f : in_focus) {
    const std::uint32_t target = std::max(f.segments, outside_[f.cell]);
    if (pending || mesh_.target(f.cell) != target) changes_.push_back({f.cell, target});
    last_found_[f.cell] = searches_;
  }
  for (const CellTarget& f : in_focus_) {
    if (last_found_[f.cell] != searches_) changes_.push_back({f.cell, outside_[f.cell]});
  }
}

RestorationMove LocalRestoration::move(const Focus& focus) {
  const FocusTest test(focus);
  RestorationMove result;
  // Cells show where they lie once they are there, and places only widen: so this ends.
  for (bool first = true;; first = false) {
    find_cells(test, found_);
    const auto same = [](const CellTarget& a, const CellTarget& b) {
      return a.cell == b.cell && a.segments == b.segments;
    };
    if (!first && std::equal(found_.begin(), found_.end(), in_focus_.begin(), in_focus_.end(), same)) break;
    change_targets(found_);
    in_focus_.swap(found_);
    const MeshMove move = mesh_.move_to(changes_);
    changes_.clear();
    result.applied += move.applied;
    result.undone += move.undone;
    result.damage.insert(result.damage.end(), move.damage.begin(), move.damage.end());
    const std::vector<std::uint32_t> changed = mesh_.take_changed_cells();
    surface_.update(changed);
    if (measured_) break;
    note_places(changed);
  }
  const bool all_is_one = outside_.empty() && !test.is_empty() && test.may_touch(surface_.box());
  result.focus_cells =
      all_is_one ? 1
                 : static_cast<std::uint32_t>(std::count_if(in_focus_.begin(), in_focus_.end(),
                                                            [](const CellTarget& f) { return f.segments == kAll; }));
  result.covered = std::none_of(in_focus_.begin(), in_focus_.end(), [&](const CellTarget& f) {
    return mesh_.applied_prefix(f.cell) < std::min(f.segments, mesh_.index().cells[f.cell].segment_count);
  });
  return result;
}

// --- What is lacking ---

std::vector<CellTarget> LocalRestoration::missing() const {
  const AssetIndex& index = mesh_.index();
  std::vector<std::uint32_t> needed(outside_.size(), 0);
  std::vector<bool> seen(outside_.size(), false);
  std::vector<std::uint32_t> stuck;
  const auto need = [&](std::uint32_t c, std::uint32_t segments) {
    needed[c] = std::max(needed[c], std::min(segments, index.cells[c].segment_count));
    if (seen[c]) return;
    seen[c] = true;
    stuck.push_back(c);
  };
  for (std::uint32_t c = 0; c < needed.size(); ++c) {
    const bool lacks = mesh_.applied_prefix(c) < std::min(mesh_.target(c), index.cells[c].segment_count);
    if (mesh_.is_live(c) && lacks) need(c, mesh_.target(c));
  }
  // What holds up the next segment of a cell has to be finer itself.
  std::vector<std::uint32_t> blocking;
  while (!stuck.empty()) {
    const std::uint32_t c = stuck.back();
    stuck.pop_back();
    mesh_.find_blocking(c, blocking);
    for (const std::uint32_t b : blocking) need(b, mesh_.begun_prefix(b) + 1);
  }
  std::vector<CellTarget> list;
  for (std::uint32_t c = 0; c < needed.size(); ++c) {
    if (needed[c] > mesh_.held_prefix(c)) list.push_back({c, needed[c]});
  }
  return list;
}

double LocalRestoration::largest_error() const {
  double largest = 0.0;
  for (std::uint32_t c = 0; c < outside_.size(); ++c) {
    if (mesh_.is_live(c) && mesh_.vertices(c).count() > 0) largest = std::max(largest, error_now(c));
  }
  return largest;
}

}  // namespace fanstream
