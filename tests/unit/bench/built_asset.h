// A small model as an open asset with many small cells.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "server/build/asset_builder.h"
#include "tests/bench/open_asset.h"

namespace fanstream::bench {

inline BuildOptions small_cells() {
  BuildOptions options;
  options.position_bits = 12;
  options.base_vertices = 64;
  options.cell_vertices = 16;
  options.segment_splits = 20.0;
  options.slab_growth = 3.5;
  return options;
}

inline std::shared_ptr<const OpenAsset> built_asset(const TriangleMesh& mesh, const BuildOptions& options) {
  Result<BuiltAsset> built = build_asset(mesh, options);
  if (!built) {
    ADD_FAILURE() << built.error().message;
    return nullptr;
  }
  Result<std::shared_ptr<const OpenAsset>> asset = OpenAsset::open(std::move(built->bytes), "test asset");
  if (!asset) {
    ADD_FAILURE() << asset.error().message;
    return nullptr;
  }
  return *asset;
}

}  // namespace fanstream::bench
