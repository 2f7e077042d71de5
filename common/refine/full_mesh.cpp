#include "common/refine/full_mesh.h"

namespace fanstream {

Result<std::unique_ptr<ProgressiveMesh>> load_full(const AssetFile& asset) {
  auto mesh = std::make_unique<ProgressiveMesh>(asset.asset_head());
  mesh->set_index(asset.asset_index());
  for (std::uint32_t c = 0; c < asset.cell_count(); ++c) {
    for (std::uint32_t s = 0; s < asset.segment_count(c); ++s) {
      if (Result<void> added = mesh->add_segment(c, s, asset.segment(c, s)); !added) {
        return tl::unexpected(with_context(added.error(), asset.name()));
      }
    }
  }
  if (Result<std::uint64_t> refined = mesh->refine(); !refined) {
    return tl::unexpected(with_context(refined.error(), asset.name()));
  }
  if (!mesh->is_complete()) {
    return fail(ErrorKind::bad_input, asset.name() + ": refinement stops at " + std::to_string(mesh->vertex_count()) +
                                          " of " + std::to_string(asset.vertex_count()) +
                                          " vertices, though every segment is there");
  }
  return mesh;
}

}  // namespace fanstream
