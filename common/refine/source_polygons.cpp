#include "common/refine/source_polygons.h"

#include <algorithm>

#include "common/refine/diagonal_coder.h"

namespace fanstream {
namespace {

bool is_final(const FanState& state, VertexId v) { return state.vertices[v].context.next == kNeverSplit; }

bool has_final_ring(const FanState& state, VertexId v) {
  bool final = is_final(state, v);
  state.fans.for_each_neighbour(v, [&](VertexId w) { final = final && is_final(state, w); });
  return final;
}

}  // namespace

Result<SourcePolygons> SourcePolygons::read(std::span<const std::byte> bytes, const AssetHead& head,
                                            const AssetIndex& index, const std::string& name) {
  Result<PolygonSection> section = read_polygons(bytes, head, index, name);
  if (!section) return tl::unexpected(section.error());
  SourcePolygons polygons;
  polygons.name_ = name;
  polygons.section_ = std::move(*section);
  polygons.unit_ = head.grid.unit();
  polygons.one_block_ = index.cells.empty();
  polygons.first_cell_ = first_polygon_cell(index);
  polygons.state_.assign(polygons.section_.ends.size(), BlockState::waiting);
  polygons.diagonals_.resize(polygons.section_.ends.size());
  return polygons;
}

Result<void> SourcePolygons::update(const ProgressiveMesh& mesh) {
  const FanState& state = mesh.state();
  constexpr std::uint32_t kUnfinished = ~std::uint32_t{0};
  std::vector<std::uint32_t> counts(state_.size(), 0);  // of vertices in blocks that can be decoded
  const std::vector<VertexId> in_order = mesh.vertices_in_order();
  const std::vector<VertexId> numbers = mesh.asset_numbers();
  const auto each_waiting = [&](auto&& use) {
    for (const VertexId v : in_order) {
      const std::uint32_t block = block_of(state, v);
      if (block == kNoBlock || state_[block] != BlockState::waiting || counts[block] == kUnfinished) continue;
      use(block, v);
    }
  };
  each_waiting([&](std::uint32_t block, VertexId v) {
    counts[block] = has_final_ring(state, v) ? counts[block] + 1 : kUnfinished;
  });
  std::vector<std::vector<VertexId>> vertices(state_.size());
  each_waiting([&](std::uint32_t block, VertexId v) { vertices[block].push_back(v); });
  const DiagonalModel model(section_.statistics);
  DiagonalCoder coder(state, unit_, numbers);
  Result<void> result;
  for (std::uint32_t b = 0; b < state_.size(); ++b) {
    if (vertices[b].empty()) continue;
    RansDecoder decoder(section_.block(b));
    coder.code(
        vertices[b], [&](std::size_t context, std::uint64_t) { return decoder.symbol(model.table(context), 0) != 0; },
        diagonals_[b]);
    if (decoder.finished_cleanly()) {
      state_[b] = BlockState::known;
      ++known_count_;
      continue;
    }
    state_[b] = BlockState::damaged;
    diagonals_[b].clear();
    result = fail(ErrorKind::bad_input, name_ + ": polygons: block " + std::to_string(b) +
                                            " is damaged; its faces stay triangles; build the asset again");
  }
  return result;
}

bool SourcePolygons::is_diagonal(std::uint32_t block, VertexId a, VertexId b) const {
  return std::binary_search(diagonals_[block].begin(), diagonals_[block].end(), edge_key(a, b));
}

namespace {

// A triangle of the live mesh: whether it is one of the full model of which all edges are known, and its diagonals.
struct TriangleFacts {
  std::vector<std::uint8_t> final;  // by triangle
  std::vector<std::uint8_t> inner;  // by triangle, as for join_triangles
};

TriangleFacts facts_of(const ProgressiveMesh& mesh, const std::vector<Triangle>& triangles,
                       const SourcePolygons* polygons) {
  const FanState& state = mesh.state();
  const std::vector<VertexId> vertices = mesh.vertices_in_order();  // by compact number
  const std::vector<VertexId> numbers = mesh.asset_numbers();
  const bool whole = mesh.has_index() || mesh.head().layer_ends.empty();  // else nothing is known of later splits
  TriangleFacts facts{std::vector<std::uint8_t>(triangles.size(), 0), std::vector<std::uint8_t>(triangles.size(), 0)};
  for (std::size_t t = 0; t < triangles.size() && whole; ++t) {
    bool final = true;
    for (const VertexId v : triangles[t]) final = final && is_final(state, vertices[v]);
    unsigned inner = 0;
    for (unsigned k = 0; k < 3 && final && polygons != nullptr; ++k) {
      const VertexId a = vertices[triangles[t][k]];
      const VertexId b = vertices[triangles[t][(k + 1) % 3]];
      const std::uint32_t block = polygons->block_of(state, numbers[a] < numbers[b] ? a : b);
      final = polygons->is_known(block);
      if (final && polygons->is_diagonal(block, numbers[a], numbers[b])) inner |= 1U << k;
    }
    facts.final[t] = final ? 1 : 0;
    facts.inner[t] = static_cast<std::uint8_t>(final ? inner : 0U);
  }
  return facts;
}

}  // namespace

LiveFaces live_faces(const ProgressiveMesh& mesh, const SourcePolygons* polygons) {
  TriangleMesh triangles = mesh.triangle_mesh();
  TriangleFacts facts = facts_of(mesh, triangles.triangles, polygons);
  const std::vector<std::uint8_t> told = facts.inner;
  LiveFaces live;
  live.faces = join_triangles(triangles.triangles, facts.inner);
  // A polygon of which a part is still to come is none yet.
  std::vector<std::uint8_t> partial(live.faces.face_count(), 0);
  bool any = false;
  for (std::size_t t = 0; t < told.size(); ++t) {
    if (told[t] == facts.inner[t]) continue;
    partial[live.faces.face_of_triangle[t]] = 1;
    any = true;
  }
  if (any) {
    for (std::size_t t = 0; t < told.size(); ++t) {
      if (partial[live.faces.face_of_triangle[t]] == 0) continue;
      facts.inner[t] = 0;
      facts.final[t] = 0;
    }
    live.faces = join_triangles(triangles.triangles, facts.inner);
  }
  live.finest.assign(live.faces.face_count(), 0);
  for (std::size_t t = 0; t < told.size(); ++t) live.finest[live.faces.face_of_triangle[t]] = facts.final[t];
  live.positions = std::move(triangles.positions);
  live.triangles = std::move(triangles.triangles);
  return live;
}

}  // namespace fanstream
