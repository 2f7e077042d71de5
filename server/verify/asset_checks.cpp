#include "server/verify/asset_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "common/geometry/mesh_distance.h"
#include "common/mesh/manifold_check.h"
#include "common/refine/full_mesh.h"
#include "server/verify/polygon_checks.h"

namespace fanstream {
namespace {

constexpr std::uint64_t kOrderSeed = 20'240'229;
constexpr std::size_t kPortions = 16;  // refine() calls while segments arrive
constexpr std::size_t kLevelsMeasured = 4;
constexpr std::size_t kSamples = 20'000;

tl::unexpected<Error> broken(const AssetFile& asset, const std::string& what) {
  return fail(ErrorKind::bad_input, asset.name() + ": " + what + "; build the asset again");
}

// Faces by vertex number, each beginning with its least corner, in order: equal for equal meshes.
std::vector<Triangle> canonical_faces(const FanState& state) {
  std::vector<Triangle> faces = state.fans.triangles();
  for (Triangle& t : faces) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  std::sort(faces.begin(), faces.end());
  return faces;
}

bool same_mesh(const ProgressiveMesh& a, const ProgressiveMesh& b) {
  return a.vertex_count() == b.vertex_count() && a.state().places() == b.state().places() &&
         canonical_faces(a.state()) == canonical_faces(b.state());
}

// Opening the file has compared them all.
Result<std::string> check_checksums(const AssetFile& asset) {
  return fmt::format("the digest and {} blocks", asset.preamble().block_count());
}

Result<std::string> check_refinement(const AssetFile& asset) {
  Result<std::unique_ptr<ProgressiveMesh>> full = load_full(asset);
  if (!full) return tl::unexpected(full.error());
  const TriangleMesh mesh = (*full)->triangle_mesh();
  if (mesh.triangles.size() != asset.triangle_count()) {
    return broken(
        asset, fmt::format("refines to {} triangles, its head says {}", mesh.triangles.size(), asset.triangle_count()));
  }
  const std::size_t components = count_components(mesh.positions.size(), mesh.triangles);
  if (components != asset.asset_head()->component_count) {
    return broken(asset, fmt::format("refines to {} components, its head says {}", components,
                                     asset.asset_head()->component_count));
  }
  std::string why;
  if (!is_oriented_manifold(mesh, &why)) return broken(asset, "the full model is no oriented manifold: " + why);
  return fmt::format("{} vertices, {} triangles, an oriented manifold", mesh.positions.size(), mesh.triangles.size());
}

Result<std::string> check_order(const AssetFile& asset) {
  struct Place {
    std::uint32_t cell, segment;
  };
  std::vector<Place> order;
  for (std::uint32_t c = 0; c < asset.cell_count(); ++c) {
    for (std::uint32_t s = 0; s < asset.segment_count(c); ++s) order.push_back({c, s});
  }
  std::mt19937_64 random(kOrderSeed);
  std::shuffle(order.begin(), order.end(), random);
  ProgressiveMesh mesh(asset.asset_head());
  mesh.set_index(asset.asset_index());
  const std::size_t portion = order.size() / kPortions + 1;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto [cell, segment] = order[i];
    Result<void> added = mesh.add_segment(cell, segment, asset.segment(cell, segment));
    if (!added) return tl::unexpected(with_context(added.error(), asset.name()));
    if ((i + 1) % portion != 0 && i + 1 != order.size()) continue;
    if (Result<std::uint64_t> refined = mesh.refine(); !refined) {
      return tl::unexpected(with_context(refined.error(), asset.name() + ": segments in another order"));
    }
  }
  Result<std::unique_ptr<ProgressiveMesh>> full = load_full(asset);
  if (!full) return tl::unexpected(full.error());
  if (!same_mesh(mesh, **full)) return broken(asset, "segments in another order give another mesh");
  return fmt::format("{} segments shuffled give the same mesh", order.size());
}

Result<std::string> check_coarsening(const AssetFile& asset) {
  Result<std::unique_ptr<ProgressiveMesh>> full = load_full(asset);
  if (!full) return tl::unexpected(full.error());
  ProgressiveMesh& mesh = **full;
  const std::vector<Triangle> faces = canonical_faces(mesh.state());
  const std::vector<GridPoint> places = mesh.state().places();
  const std::uint64_t undone = mesh.coarsen_to(0);
  const ProgressiveMesh base(asset.asset_head());
  const std::vector<GridPoint> base_places = base.state().places();
  const std::vector<GridPoint> coarsened_places = mesh.state().places();
  const bool same_base = mesh.vertex_count() == base.vertex_count() &&
                         canonical_faces(mesh.state()) == canonical_faces(base.state()) &&
                         std::equal(base_places.begin(), base_places.end(), coarsened_places.begin());
  if (!same_base) return broken(asset, "undoing all splits does not give back FM0");
  if (Result<std::uint64_t> again = mesh.refine(); !again) {
    return tl::unexpected(with_context(again.error(), asset.name() + ": refined again after coarsening"));
  }
  if (!mesh.is_complete() || canonical_faces(mesh.state()) != faces || mesh.state().places() != places) {
    return broken(asset, "refining again after coarsening gives another mesh");
  }
  return fmt::format("{} splits undone and done again", undone);
}

// The largest error code of what each cell lacks at every layer, or nothing if the asset states no bounds.
Result<std::vector<std::uint8_t>> codes_by_layer(const AssetFile& asset) {
  const AssetHead& head = *asset.asset_head();
  const AssetIndex& index = *asset.asset_index();
  std::vector<std::uint8_t> largest(head.layer_ends.size(), 0);
  std::vector<std::uint8_t> least(index.cells.size(), 255);  // of the cell and those it came from
  for (std::uint32_t c = 0; c < index.cells.size(); ++c) {
    const CellEntry& cell = index.cells[c];
    if (cell.slab > 0) least[c] = least[cell.parent];
    for (std::uint32_t s = 0; s < cell.segment_count; ++s) {
      const SegmentEntry& segment = index.segments[cell.first_segment + s];
      if (segment.size_bytes == 0) continue;
      if (segment.error_code > least[c]) {
        return broken(asset,
                      fmt::format("cell {} segment {}: its error bound is larger than that of a coarser one", c, s));
      }
      least[c] = segment.error_code;
      std::uint8_t& of_layer = largest[head.layer_begin(cell.slab) + s];
      of_layer = std::max(of_layer, segment.error_code);
    }
  }
  return largest;
}

Result<std::string> check_bounds(const AssetFile& asset) {
  const AssetHead& head = *asset.asset_head();
  const Result<std::vector<std::uint8_t>> codes = codes_by_layer(asset);
  if (!codes) return tl::unexpected(codes.error());
  if (std::all_of(codes->begin(), codes->end(), [](std::uint8_t code) { return code == 0; })) return "none are stated";
  Result<std::unique_ptr<ProgressiveMesh>> full = load_full(asset);
  if (!full) return tl::unexpected(full.error());
  ProgressiveMesh& mesh = **full;
  const TriangleMesh original = mesh.triangle_mesh();
  const std::size_t layers = head.layer_ends.size();
  const std::size_t stride = std::max<std::size_t>(1, layers / kLevelsMeasured);
  double tightest = 0.0;
  for (std::size_t layer = layers; layer-- > 0;) {  // coarsening goes downwards only
    if (layer % stride != 0) continue;
    mesh.coarsen_to(layer == 0 ? 0 : head.layer_ends[layer - 1]);
    const Result<TriangleTree> level = TriangleTree::build(mesh.triangle_mesh());
    if (!level) return tl::unexpected(with_context(level.error(), asset.name()));
    const Result<DirectedDistance> distance = directed_distance(original, *level, {.face_samples = kSamples});
    if (!distance) return tl::unexpected(with_context(distance.error(), asset.name()));
    // A level lacks this layer and all finer ones.
    const std::uint8_t code = *std::max_element(codes->begin() + static_cast<std::ptrdiff_t>(layer), codes->end());
    const double bound = error_from_code(code, head.grid.step());
    if (distance->max > bound * (1.0 + 1e-9)) {
      return broken(asset, fmt::format("without layer {} the model is off by {:.4g}, its bound says {:.4g}", layer,
                                       distance->max, bound));
    }
    if (bound > 0.0) tightest = std::max(tightest, distance->max / bound);
  }
  return fmt::format("monotone; sampled errors reach {:.0f} % of them", tightest * 100.0);
}

}  // namespace

std::vector<AssetCheck> asset_checks(const AssetFile& asset) {
  const AssetFile* a = &asset;
  return {{"checksums", [a] { return check_checksums(*a); }}, {"refinement", [a] { return check_refinement(*a); }},
          {"order", [a] { return check_order(*a); }},         {"coarsening", [a] { return check_coarsening(*a); }},
          {"bounds", [a] { return check_bounds(*a); }},       {"polygons", [a] { return check_polygon_section(*a); }}};
}

}  // namespace fanstream
