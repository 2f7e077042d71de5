// Arbitrary bytes as an asset file: preamble, head (with FM0 through Draco), cell table, and then all segments,
// refined. The digest and the blocks' checksums are made to fit, since no mutation would get past them. Whatever
// refines without an error must be a mesh that can be drawn, coarsened to FM0 and refined again. Input: a whole asset
// (it begins with F); or a byte that chooses one of the built assets, then edits of it: (u16 place, byte).
#include <algorithm>
#include <cstdlib>

#include "common/asset/asset_file.h"
#include "common/refine/source_polygons.h"
#include "tests/fuzz/built_assets.h"

using namespace fanstream;

namespace {

constexpr std::uint32_t kMostVerticesHere = 1U << 16U;  // keeps a run fast; larger counts are refused after parsing

void require(bool condition) {
  if (!condition) std::abort();
}

// What lies behind the preamble, sealed; of a file that is not as long as its preamble says, nothing is changed.
std::vector<std::byte> with_fitting_checksums(std::vector<std::byte> bytes) {
  const auto preamble = read_preamble(bytes, "fuzz");
  if (!preamble || preamble->file_bytes() != bytes.size()) return bytes;
  return assemble_file(*preamble, std::span(bytes).first(preamble->section_bytes()).subspan(kPreambleBytes));
}

void check_drawable(const ProgressiveMesh& mesh) {
  const TriangleMesh drawn = mesh.triangle_mesh();
  require(drawn.positions.size() == mesh.vertex_count());
  for (const Triangle& triangle : drawn.triangles) {
    for (const VertexId v : triangle) require(v < drawn.positions.size());
  }
}

// Whatever the section says, faces cover the mesh.
void check_polygons(const ProgressiveMesh& mesh) {
  if (mesh.polygon_bytes().empty()) return;
  auto polygons = SourcePolygons::read(mesh.polygon_bytes(), mesh.head(), mesh.index(), "fuzz");
  if (!polygons) return;
  (void)polygons->update(mesh);
  const LiveFaces live = live_faces(mesh, &*polygons);
  std::size_t triangles = 0;
  for (std::uint32_t f = 0; f < live.faces.face_count(); ++f) {
    require(live.faces.face(f).size() >= 3);
    triangles += live.faces.face(f).size() - 2;
  }
  require(triangles == live.triangles.size());
}

std::vector<std::byte> input_file(std::span<const std::byte> data) {
  static const std::vector<std::vector<std::byte>> built = testing::build_small_assets();
  if (data.empty() || data[0] == std::byte{'F'}) return {data.begin(), data.end()};
  std::vector<std::byte> file = built[std::to_integer<std::size_t>(data[0]) % built.size()];
  for (std::size_t i = 1; i + 2 < data.size(); i += 3) {
    const auto place = std::to_integer<std::size_t>(data[i]) | std::to_integer<std::size_t>(data[i + 1]) << 8U;
    file[place % file.size()] = data[i + 2];
  }
  return file;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto asset =
      AssetFile::from_memory(with_fitting_checksums(input_file(std::as_bytes(std::span(data, size)))), "fuzz");
  if (!asset) {
    require(asset.error().message.starts_with("fuzz: "));
    return 0;
  }
  if ((*asset)->vertex_count() > kMostVerticesHere) return 0;
  ProgressiveMesh mesh((*asset)->asset_head());
  const std::uint32_t base_vertices = mesh.vertex_count();
  mesh.set_index((*asset)->asset_index());
  for (std::uint32_t c = 0; c < (*asset)->cell_count(); ++c) {
    for (std::uint32_t s = 0; s < (*asset)->segment_count(c); ++s) {
      require(mesh.add_segment(c, s, (*asset)->segment(c, s)).has_value());
    }
  }
  const bool refined = mesh.refine().has_value();
  check_drawable(mesh);
  check_polygons(mesh);
  if (!refined) return 0;
  const std::uint32_t vertices = mesh.vertex_count();
  mesh.coarsen_to(0);
  require(mesh.vertex_count() == base_vertices);
  check_drawable(mesh);
  require(mesh.refine().has_value());
  require(mesh.vertex_count() == vertices);
  return 0;
}
