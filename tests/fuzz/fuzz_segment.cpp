// Arbitrary bytes in place of segments of small valid assets, whose cell tables are made to fit so that the decoder
// itself is reached. Input: a byte that chooses the asset, then any number of (cell byte, segment byte, size byte,
// bytes). Segments that the input does not name keep their own bytes.
#include <algorithm>
#include <cstdlib>
#include <map>

#include "common/asset/asset_file.h"
#include "common/refine/progressive_mesh.h"
#include "tests/fuzz/built_assets.h"

using namespace fanstream;

namespace {

std::vector<std::shared_ptr<const AssetFile>> open_assets() {
  std::vector<std::shared_ptr<const AssetFile>> assets;
  for (std::vector<std::byte>& bytes : testing::build_small_assets()) {
    assets.push_back(AssetFile::from_memory(std::move(bytes), "built").value());
    if (assets.back()->cell_count() == 0) assets.pop_back();  // nothing to replace
  }
  return assets;
}

void require(bool condition) {
  if (!condition) std::abort();
}

std::vector<Triangle> faces_of(const ProgressiveMesh& mesh) {
  std::vector<Triangle> faces = mesh.state().fans.triangles();
  for (Triangle& t : faces) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  std::sort(faces.begin(), faces.end());
  return faces;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<std::shared_ptr<const AssetFile>> assets = open_assets();
  if (size == 0) return 0;
  const AssetFile* const asset = assets[*data++ % assets.size()].get();
  --size;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::byte>> replaced;
  const std::uint8_t* const end = data + size;
  while (end - data > 3) {
    const auto cell = static_cast<std::uint32_t>(data[0] % asset->asset_index()->cells.size());
    const std::uint32_t segment = data[1] % asset->asset_index()->cells[cell].segment_count;  // no page
    const std::size_t length =
        std::min<std::size_t>(data[2], static_cast<std::size_t>(end - data - 3)) & ~std::size_t{1};  // they are even
    const std::span<const std::byte> bytes = std::as_bytes(std::span(data + 3, length));
    replaced[{cell, segment}].assign(bytes.begin(), bytes.end());
    data += 3 + length;
  }
  auto index = std::make_shared<AssetIndex>(*asset->asset_index());
  for (const auto& [place, bytes] : replaced) {
    SegmentEntry& entry = index->segments[index->cells[place.first].first_segment + place.second];
    entry.size_bytes = static_cast<std::uint32_t>(bytes.size());
  }
  ProgressiveMesh mesh(asset->asset_head());
  const std::vector<Triangle> base = faces_of(mesh);
  mesh.set_index(index);
  for (std::uint32_t c = 0; c < asset->cell_count(); ++c) {
    for (std::uint32_t s = 0; s < asset->segment_count(c); ++s) {
      const auto found = replaced.find({c, s});
      require(mesh.add_segment(
                      c, s, found == replaced.end() ? asset->segment(c, s) : std::span<const std::byte>(found->second))
                  .has_value());
    }
  }
  const bool refined = mesh.refine().has_value();
  const TriangleMesh drawn = mesh.triangle_mesh();
  require(drawn.positions.size() == mesh.vertex_count());
  for (const Triangle& triangle : drawn.triangles) {
    for (const VertexId v : triangle) require(v < drawn.positions.size());
  }
  if (!refined) return 0;
  const std::vector<Triangle> full = faces_of(mesh);
  mesh.coarsen_to(0);
  require(faces_of(mesh) == base);
  require(mesh.refine().has_value());
  require(faces_of(mesh) == full);
  return 0;
}
