#include "tests/support/asset_helpers.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/mesh/manifold_check.h"
#include "tests/support/fan_test_meshes.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/ring_views.h"

namespace fanstream::testing {

std::span<const std::byte> OpenAsset::segment(std::uint32_t cell, std::uint32_t number) const {
  return std::span(bytes).subspan(index->piece_offset(cell, number), index->piece_bytes(cell, number));
}

std::shared_ptr<const AssetIndex> OpenAsset::first_index() const {
  Result<AssetIndex> first = read_index(index_bytes(), preamble, *head, "asset");
  EXPECT_TRUE(first) << first.error().message;
  return first ? std::make_shared<const AssetIndex>(std::move(*first)) : nullptr;
}

std::vector<std::pair<std::uint32_t, std::uint32_t>> OpenAsset::segments() const {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> all;
  for (std::uint32_t c = 0; c < index->cells.size(); ++c) {
    for (std::uint32_t s = 0; s < index->cells[c].segment_count; ++s) {
      if (!segment(c, s).empty()) all.emplace_back(c, s);
    }
  }
  return all;
}

Result<OpenAsset> open_asset(std::vector<std::byte> bytes) {
  OpenAsset asset;
  asset.bytes = std::move(bytes);
  const Result<AssetPreamble> preamble = read_preamble(asset.bytes, "asset");
  if (!preamble) return tl::unexpected(preamble.error());
  asset.preamble = *preamble;
  if (preamble->file_bytes() != asset.bytes.size()) return fail(ErrorKind::bad_input, "sections do not add up");
  Result<AssetHead> head = read_head(asset.head_bytes(), "asset");
  if (!head) return tl::unexpected(head.error());
  Result<AssetIndex> index = read_whole_index(asset.bytes, asset.preamble, *head, "asset");
  if (!index) return tl::unexpected(index.error());
  asset.head = std::make_shared<AssetHead>(std::move(*head));
  asset.index = std::make_shared<AssetIndex>(std::move(*index));
  return asset;
}

BuildOptions small_cells() {
  BuildOptions options;
  options.base_vertices = 60;
  options.cell_vertices = 16;
  options.segment_splits = 12.0;
  options.slab_growth = 2.5;
  options.paged_cells = 1;
  return options;
}

OpenAsset build_and_open(const TriangleMesh& mesh, const BuildOptions& options) {
  Result<BuiltAsset> built = build_asset(mesh, options);
  EXPECT_TRUE(built) << built.error().message;
  if (!built) return {};
  Result<OpenAsset> asset = open_asset(std::move(built->bytes));
  EXPECT_TRUE(asset) << asset.error().message;
  return asset ? std::move(*asset) : OpenAsset{};
}

std::unique_ptr<ProgressiveMesh> start(const OpenAsset& asset) {
  auto mesh = std::make_unique<ProgressiveMesh>(asset.head);
  mesh->set_index(asset.index);
  return mesh;
}

std::unique_ptr<ProgressiveMesh> fully_refined(const OpenAsset& asset) {
  auto mesh = start(asset);
  for (const auto& [cell, segment] : asset.segments()) {
    const Result<void> added = mesh->add_segment(cell, segment, asset.segment(cell, segment));
    EXPECT_TRUE(added) << added.error().message;
  }
  const Result<std::uint64_t> refined = mesh->refine();
  EXPECT_TRUE(refined) << refined.error().message;
  EXPECT_TRUE(mesh->is_complete());
  return mesh;
}

TriangleMesh on_grid(const TriangleMesh& mesh, const PositionGrid& grid) {
  TriangleMesh moved = mesh;
  for (glm::dvec3& p : moved.positions) p = grid.decode(grid.encode(p));
  return moved;
}

bool is_manifold(const ProgressiveMesh& mesh, std::string* why) {
  return is_oriented_manifold(mesh.triangle_mesh(), why);
}

StateImage image_of(const ProgressiveMesh& mesh) {
  const FanState& state = mesh.state();
  const std::vector<VertexId> numbers = mesh.asset_numbers();
  const auto number = [&](VertexId v) { return v == kOutside ? v : numbers[v]; };
  StateImage image;
  for (const VertexId v : mesh.vertices_in_order()) {
    const std::size_t count = std::max(image.rings.size(), number(v) + std::size_t{1});
    image.rings.resize(count);
    image.places.resize(count);
    image.contexts.resize(count);
    image.rings[number(v)] = state.fans.ring(v);
    for (VertexId& w : image.rings[number(v)]) w = number(w);
    image.places[number(v)] = {state.vertices[v].place.x, state.vertices[v].place.y, state.vertices[v].place.z};
    image.contexts[number(v)] = {state.vertices[v].context.next, state.vertices[v].context.touched};
  }
  image.faces = state.fans.triangles();
  for (Triangle& t : image.faces) t = {number(t[0]), number(t[1]), number(t[2])};
  std::sort(image.faces.begin(), image.faces.end());
  return image;
}

std::vector<std::pair<std::string, TriangleMesh>> model_shapes() {
  std::vector<std::pair<std::string, TriangleMesh>> all;
  all.emplace_back("triangle", TriangleMesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
  all.emplace_back("two triangles", make_grid(1, 1));
  all.emplace_back("tetrahedron", make_tetrahedron());
  all.emplace_back("sphere", make_sphere(40, 50));
  all.emplace_back("torus", make_torus(30, 20));
  all.emplace_back("terrain", make_terrain(48, 44, 7));
  all.emplace_back("cylinder", make_open_cylinder(24, 30));
  all.emplace_back("flat grid", make_grid(25, 25));
  all.emplace_back("double cone", test::make_double_cone(300));
  all.emplace_back("random sphere", test::make_random_sphere(1500, 3));
  all.emplace_back("wild sphere", test::make_random_sphere(500, 4, 0));
  all.emplace_back("sphere with holes", without_unused(test::punch_holes(test::make_random_sphere(800, 5), 6)));
  TriangleMesh many;
  for (int i = 0; i < 12; ++i) {
    const glm::dvec3 offset(4.0 * i, 0, 0);
    if (i % 4 == 0) append(many, make_torus(8, 6), offset);
    if (i % 4 == 1) append(many, make_terrain(5, 5, static_cast<std::uint64_t>(i)), offset);
    if (i % 4 == 2) append(many, make_tetrahedron(), offset);
    if (i % 4 == 3) append(many, make_grid(1, 1), offset);
  }
  append(many, make_sphere(8, 8), {0, 0, 0});  // and two at the same places
  append(many, make_sphere(8, 8), {0, 0, 0});
  all.emplace_back("many components", many);
  return all;
}

}  // namespace fanstream::testing
