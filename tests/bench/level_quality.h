// The shape of levels of detail beside meshoptimizer's at the same number of triangles.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/grid/position_grid.h"
#include "common/mesh/triangle_mesh.h"
#include "common/support/result.h"
#include "server/build/coded_history.h"

namespace fanstream::bench {

// Replays a history from FM0 in coding order: coarse to fine, within a generation the dearest merge is undone first. At
// the ends of generations a client of an asset of the same precision has the same mesh; in between it has the same splits in the order of its cells.
class LevelReplay {
 public:
  // Keeps references to its arguments. `vertex_count` is the full model's.
  LevelReplay(const CodedHistory& coded, const PositionGrid& grid, std::uint32_t vertex_count);

  std::uint32_t vertex_count() const { return vertices_; }
  // Refines until there are `vertices` of them. Precondition: not fewer than there are now, not more than the model
  // has.
  void refine_to(std::uint32_t vertices);
  TriangleMesh mesh() const;  // in the model's coordinates, renumbered without gaps

 private:
  const CodedHistory& coded_;
  const PositionGrid& grid_;
  RingMesh rings_;
  std::vector<GridPoint> places_;
  std::vector<SplitPlaces> split_places_;  // by merge: where its split leaves both centres
  std::uint32_t next_ = 0;  // one past the next merge to undo
  std::uint32_t vertices_ = 0;
};

// Distances are relative to the diagonal, of both directions.
struct LevelShape {
  std::uint32_t triangles = 0;
  double rms = 0.0;
  double max = 0.0;
};

struct LevelQuality {
  double share = 0.0;  // of the full model's vertices
  std::uint32_t vertices = 0;
  LevelShape ours;
  LevelShape peer;  // meshoptimizer, started from the quantised model
  LevelShape
      peer_original;  // meshoptimizer, started from the model before it was quantised; its result put on the grid

  // Vertices that share a grid point can keep meshoptimizer from going on; then the levels cannot be compared.
  static bool comparable(const LevelShape& ours, const LevelShape& peer) {
    return peer.triangles <= 1.02 * ours.triangles;
  }
};

// Each level against `full`, the quantised model in its own coordinates; `original` is the same before it was
// quantised, from which our levels have been made (the places are the grid's, the decisions were the original's).
// Shares that lie below FM0 are left out.
Result<std::vector<LevelQuality>> measure_levels(const TriangleMesh& full, const TriangleMesh& original,
                                                 const CodedHistory& coded, const PositionGrid& grid,
                                                 std::span<const double> shares, std::size_t face_samples);

}  // namespace fanstream::bench
