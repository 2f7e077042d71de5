// A model that follows a view: the mesh, what the planner knows of its cells, and the plan. Pure logic, like the parts
// it is made of: who brings the segments, and when, is not known here.
//
//   ViewModel model(head);               // FM0 can be drawn
//   model.set_index(index);
//   for (;;) {
//     const Plan& plan = model.plan(view, options);
//     stream.want(model.wants());
//     ... model.add_segment(...) for what arrives ...
//     model.apply(split_budget);
//     stream.release(model.evict());
//   }
#pragma once

#include <memory>
#include <vector>

#include "client/view/planner.h"
#include "common/refine/progressive_mesh.h"
#include "protocol/runs.h"

namespace fanstream {

// No I/O, threads or clocks. Not thread safe; distinct objects are independent.
class ViewModel {
 public:
  explicit ViewModel(std::shared_ptr<const AssetHead> head);
  ViewModel(const ViewModel&) = delete;
  ViewModel& operator=(const ViewModel&) = delete;

  // Call once. Fails (bad_input, starting with `name`) where the index's bounds rise from coarse to fine, which its
  // reader lets pass.
  Result<void> set_index(AssetIndex index, const std::string& name);
  Result<void> set_index(const std::shared_ptr<const AssetIndex>& index, const std::string& name) {
    return set_index(AssetIndex(*index), name);
  }
  bool has_index() const { return planner_ != nullptr; }

  // As of ProgressiveMesh, or a page: then the cell's children become known, here and in mesh().index(), which is
  // not the index that was set. A segment that does not come next in its cell is kept for when it does.
  Result<void> add_segment(std::uint32_t cell, std::uint32_t segment, std::span<const std::byte> bytes);

  // Precondition of all that follow: has_index().
  //
  // What to apply, fetch and forget for this view, from how things stand. Valid until the next call.
  const Plan& plan(const View& view, const PlanOptions& options);
  // The plan's wants, packed; the polygons behind them, if they are wanted.
  std::vector<CellRun> wants() const;
  // Whether to ask for the asset's polygons, which no plan does; before, they are not.
  void want_polygons(bool wanted) { polygons_wanted_ = wanted; }
  bool wants_polygons() const {
    return polygons_wanted_ && mesh_.index().polygons.size_bytes != 0 && mesh_.polygon_bytes().empty();
  }
  // Refines and coarsens towards the plan's targets with what is held, at most about so many splits.
  MeshMove apply(std::uint64_t split_budget = ProgressiveMesh::kNoBudget);
  // Forgets the segments that the plan gives up. Returns what to tell the stream.
  std::vector<CellRun> evict();

  const ProgressiveMesh& mesh() const { return mesh_; }
  const CellTable& table() const { return table_; }
  const Plan& current_plan() const { return *plan_; }

 private:
  Result<void> add_page(std::uint32_t cell, std::span<const std::byte> bytes);
  void update_table();
  void update_prefixes(std::uint32_t cell);
  bool follow_pages();
  void update_extent(std::uint32_t cell);
  void update_dependencies(std::uint32_t cell);
  Dependency dependency_of(std::uint32_t cell, const ProgressiveMesh::Support& found) const;

  ProgressiveMesh mesh_;
  std::shared_ptr<AssetIndex> index_;  // the mesh's
  CellTable table_;
  std::unique_ptr<Planner> planner_;
  const Plan* plan_ = nullptr;
  bool polygons_wanted_ = false;
  std::vector<std::uint8_t> targets_;            // those that the mesh has been told
  std::vector<bool> closed_pages_;               // by cell that has one
  std::vector<ProgressiveMesh::Support> found_;  // scratch
  std::vector<Dependency> dependencies_;         // scratch
  std::vector<ExtentPart> parts_;                // scratch
};

}  // namespace fanstream
