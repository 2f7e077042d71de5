#include "server/build/polygon_encoding.h"

#include <algorithm>

#include "common/mesh/triangle_joining.h"
#include "common/refine/diagonal_coder.h"

namespace fanstream {
namespace {

std::vector<std::vector<VertexId>> vertices_by_block(const FanState& state, const AssetIndex& index) {
  std::vector<std::vector<VertexId>> blocks(polygon_block_count(index));
  const std::uint32_t first = first_polygon_cell(index);
  for (VertexId v = 0; v < state.fans.vertex_capacity(); ++v) {
    blocks[index.cells.empty() ? 0 : state.cells[v] - first].push_back(v);
  }
  return blocks;
}

}  // namespace

std::optional<PolygonSection> encode_polygons(const FanState& state, const glm::vec3& unit, const AssetIndex& index,
                                              std::span<const Triangle> triangles,
                                              std::span<const std::uint32_t> source_faces) {
  std::vector<std::uint8_t> inner = inner_edges(triangles, source_faces);
  const JoinedFaces faces = join_triangles(triangles, inner);
  PolygonSection section;
  for (std::uint32_t f = 0; f < faces.face_count(); ++f) {
    if (faces.face(f).size() == 4) ++section.quads;
    if (faces.face(f).size() > 4) ++section.larger;
  }
  if (section.quads + section.larger == 0) return {};
  std::vector<std::uint64_t> diagonals;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (unsigned k = 0; k < 3; ++k) {
      if ((inner[t] >> k & 1U) != 0) diagonals.push_back(edge_key(triangles[t][k], triangles[t][(k + 1) % 3]));
    }
  }
  std::sort(diagonals.begin(), diagonals.end());
  const auto is_diagonal = [&](std::uint64_t key) {
    return std::binary_search(diagonals.begin(), diagonals.end(), key);
  };
  const std::vector<std::vector<VertexId>> blocks = vertices_by_block(state, index);
  DiagonalCoder coder(state, unit);
  std::vector<std::uint64_t> found;
  std::array<std::array<std::uint64_t, 2>, kDiagonalContexts> counts{};
  for (const std::vector<VertexId>& block : blocks) {
    coder.code(
        block,
        [&](std::size_t context, std::uint64_t key) {
          const bool diagonal = is_diagonal(key);
          ++counts[context][diagonal ? 1 : 0];
          return diagonal;
        },
        found);
  }
  section.statistics = DiagonalStatistics::learn(counts);
  const DiagonalModel model(section.statistics);
  for (const std::vector<VertexId>& block : blocks) {
    RansEncoder encoder;
    coder.code(
        block,
        [&](std::size_t context, std::uint64_t key) {
          return encoder.symbol(model.table(context), is_diagonal(key) ? 1 : 0) != 0;
        },
        found);
    const std::vector<std::byte> bytes = encoder.finish();
    section.coded.insert(section.coded.end(), bytes.begin(), bytes.end());
    section.ends.push_back(static_cast<std::uint32_t>(section.coded.size()));
  }
  return section;
}

}  // namespace fanstream
