#include "tests/bench/level_quality.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/geometry/mesh_distance.h"
#include "tests/bench/meshoptimizer_peer.h"

namespace fanstream::bench {

LevelReplay::LevelReplay(const CodedHistory& coded, const PositionGrid& grid, std::uint32_t vertex_count)
    : coded_(coded),
      grid_(grid),
      rings_(coded.history.base),
      places_(coded.base_places),
      vertices_(coded.history.base_vertices) {
  rings_.reserve(vertex_count);
  std::vector<GridPoint> places = coded.model_places;
  for (std::uint32_t m = 0; m < coded.history.merges.size(); ++m) {
    const MergeRecord& merge = coded.history.merges[m];
    split_places_.push_back({places[merge.root], places[merge.removed]});
    places[merge.root] = coded.place_after(m, places[merge.root], places[merge.removed]);
  }
  next_ = static_cast<std::uint32_t>(coded.history.merges.size());
}

void LevelReplay::refine_to(std::uint32_t vertices) {
  assert(vertices >= vertices_ && vertices <= vertices_ + next_);
  while (vertices_ < vertices) {
    const MergeRecord& merge = coded_.history.merges[--next_];
    rings_.split(merge.root, merge.removed, rings_.position_in_ring(merge.root, merge.first),
                 rings_.position_in_ring(merge.root, merge.last));
    places_[merge.root] = split_places_[next_].kept;
    places_[merge.removed] = split_places_[next_].added;
    ++vertices_;
  }
}

TriangleMesh LevelReplay::mesh() const {
  TriangleMesh mesh;
  std::vector<VertexId> number(rings_.vertex_capacity(), 0);
  for (VertexId v = 0; v < number.size(); ++v) {
    if (!rings_.contains(v)) continue;
    number[v] = static_cast<VertexId>(mesh.positions.size());
    mesh.positions.push_back(grid_.decode(places_[v]));
  }
  mesh.triangles = rings_.triangles();
  for (Triangle& t : mesh.triangles) {
    for (VertexId& v : t) v = number[v];
  }
  return mesh;
}

namespace {

Result<LevelShape> shape_of(const TriangleMesh& level, const TriangleMesh& full, const TriangleTree& tree,
                            std::size_t face_samples) {
  const Result<MeshDistance> distance = mesh_distance(full, tree, level, {face_samples, 1});
  if (!distance) return tl::unexpected(distance.error());
  return LevelShape{static_cast<std::uint32_t>(level.triangles.size()), distance->relative_rms(),
                    distance->relative_max()};
}

Result<LevelShape> peer_shape(const TriangleMesh& start, std::size_t triangles, const TriangleMesh& full,
                              const TriangleTree& tree, const PositionGrid& grid, std::size_t face_samples) {
  Result<SimplifyResult> peer = simplify_with_meshoptimizer(start, {triangles});
  if (!peer) return tl::unexpected(peer.error());
  for (glm::dvec3& p : peer->mesh.positions) p = grid.decode(grid.encode(p));
  Result<LevelShape> shape = shape_of(peer->mesh, full, tree, face_samples);
  if (!shape) return tl::unexpected(with_context(shape.error(), "meshoptimizer's level"));
  return shape;
}

}  // namespace

Result<std::vector<LevelQuality>> measure_levels(const TriangleMesh& full, const TriangleMesh& original,
                                                 const CodedHistory& coded, const PositionGrid& grid,
                                                 std::span<const double> shares, std::size_t face_samples) {
  const Result<TriangleTree> tree = TriangleTree::build(full);
  if (!tree) return tl::unexpected(tree.error());
  const auto count = static_cast<std::uint32_t>(full.positions.size());
  LevelReplay replay(coded, grid, count);
  std::vector<double> ascending(shares.begin(), shares.end());
  std::sort(ascending.begin(), ascending.end());
  std::vector<LevelQuality> levels;
  for (const double share : ascending) {
    LevelQuality level;
    level.share = share;
    level.vertices = static_cast<std::uint32_t>(std::lround(share * count));
    if (level.vertices < replay.vertex_count()) continue;
    replay.refine_to(level.vertices);
    const Result<LevelShape> ours = shape_of(replay.mesh(), full, *tree, face_samples);
    if (!ours) return tl::unexpected(with_context(ours.error(), "our level"));
    const Result<LevelShape> peer = peer_shape(full, ours->triangles, full, *tree, grid, face_samples);
    if (!peer) return tl::unexpected(peer.error());
    const Result<LevelShape> peer_original = peer_shape(original, ours->triangles, full, *tree, grid, face_samples);
    if (!peer_original) return tl::unexpected(peer_original.error());
    level.ours = *ours;
    level.peer = *peer;
    level.peer_original = *peer_original;
    levels.push_back(level);
  }
  std::reverse(levels.begin(), levels.end());  // fine to coarse
  return levels;
}

}  // namespace fanstream::bench
