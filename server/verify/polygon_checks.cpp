#include "server/verify/polygon_checks.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/mesh/triangle_joining.h"
#include "common/refine/full_mesh.h"
#include "common/refine/source_polygons.h"

namespace fanstream {
namespace {

using Code = std::array<std::int32_t, 3>;
using Face = std::vector<Code>;

// Faces of more than three corners as points of the grid, each beginning so that it is least; sorted.
std::vector<Face> coded_polygons(const JoinedFaces& faces, const std::vector<glm::dvec3>& positions,
                                 const PositionGrid& grid) {
  std::vector<Face> coded;
  for (std::uint32_t f = 0; f < faces.face_count(); ++f) {
    if (faces.face(f).size() <= 3) continue;
    Face face;
    for (const VertexId v : faces.face(f)) {
      const GridPoint code = grid.encode(positions[v]);
      face.push_back({code.x, code.y, code.z});
    }
    Face least = face;
    for (std::size_t i = 1; i < face.size(); ++i) {
      std::rotate(face.begin(), face.begin() + 1, face.end());
      least = std::min(least, face);
    }
    coded.push_back(std::move(least));
  }
  std::sort(coded.begin(), coded.end());
  return coded;
}

std::string text_of(const Face& face) {
  std::string text;
  for (const Code& code : face) text += fmt::format("({} {} {})", code[0], code[1], code[2]);
  return text;
}

Result<LiveFaces> full_faces(const AssetFile& asset) {
  Result<std::unique_ptr<ProgressiveMesh>> full = load_full(asset);
  if (!full) return tl::unexpected(full.error());
  const AssetIndex& index = *asset.asset_index();
  if (index.polygons.size_bytes == 0) return live_faces(**full, nullptr);
  Result<SourcePolygons> polygons =
      SourcePolygons::read((*full)->polygon_bytes(), *asset.asset_head(), index, asset.name());
  if (!polygons) return tl::unexpected(polygons.error());
  if (Result<void> decoded = polygons->update(**full); !decoded) return tl::unexpected(decoded.error());
  return live_faces(**full, &*polygons);
}

}  // namespace

Result<std::string> check_polygon_section(const AssetFile& asset) {
  const AssetIndex& index = *asset.asset_index();
  if (index.polygons.size_bytes == 0) return "none";
  const auto broken = [&](const std::string& what) {
    return fail(ErrorKind::bad_input, asset.name() + ": polygons: " + what + "; build the asset again");
  };
  const Result<PolygonSection> section =
      read_polygons(asset.segment(index.polygon_cell(), 0), *asset.asset_head(), index, asset.name());
  if (!section) return tl::unexpected(section.error());
  const Result<LiveFaces> live = full_faces(asset);
  if (!live) return tl::unexpected(live.error());
  const auto unfinished = std::count(live->finest.begin(), live->finest.end(), 0);
  if (unfinished > 0) return broken(fmt::format("{} faces of the full model lie in no sound polygon", unfinished));
  std::uint64_t quads = 0, larger = 0;
  for (std::uint32_t f = 0; f < live->faces.face_count(); ++f) {
    quads += live->faces.face(f).size() == 4 ? 1 : 0;
    larger += live->faces.face(f).size() > 4 ? 1 : 0;
  }
  if (quads != section->quads || larger != section->larger) {
    return broken(fmt::format("{} quads and {} larger faces, the section says {} and {}", quads, larger, section->quads,
                              section->larger));
  }
  return fmt::format("{} quads, {} larger faces in {} blocks", quads, larger, section->ends.size());
}

Result<std::string> compare_polygons(const AssetFile& asset, const CleanedMesh& cleaned,
                                     const std::string& input_name) {
  const PositionGrid& grid = asset.asset_head()->grid;
  const Result<LiveFaces> live = full_faces(asset);
  if (!live) return tl::unexpected(live.error());
  std::vector<std::uint8_t> inner = inner_edges(cleaned.mesh.triangles, cleaned.source_faces);
  const JoinedFaces joined = join_triangles(cleaned.mesh.triangles, inner);
  const std::vector<Face> of_asset = coded_polygons(live->faces, live->positions, grid);
  const std::vector<Face> of_input = coded_polygons(joined, cleaned.mesh.positions, grid);
  if (of_asset == of_input) return fmt::format("{} polygons", of_input.size());
  const auto only = [](const std::vector<Face>& a, const std::vector<Face>& b) {
    std::vector<Face> left;
    std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(left));
    return left;
  };
  std::string text;
  const auto add = [&](const std::vector<Face>& faces, const char* where) {
    if (faces.empty()) return;
    text += fmt::format("{}{} only in {}: {}", text.empty() ? "" : "; ", faces.size(), where, text_of(faces.front()));
  };
  add(only(of_asset, of_input), "the asset");
  add(only(of_input, of_asset), "the input");
  return fail(ErrorKind::bad_input,
              asset.name() + " is not " + input_name + ": polygons differ: " + text + " (points of the grid)");
}

}  // namespace fanstream
