// Small assets for tests, built by the real builder with options that give several generations, slabs and cells all the
// same.
#pragma once

#include "server/build/asset_builder.h"
#include "tests/support/mesh_generators.h"

namespace fanstream::testing {

inline BuildOptions small_build_options() {
  BuildOptions options;
  options.position_bits = 10;
  options.base_vertices = 24;
  options.cell_vertices = 12;
  options.segment_splits = 8;
  options.slab_growth = 3.5;
  options.paged_cells = 1;
  return options;
}

// Precondition: mesh is an oriented manifold.
inline std::vector<std::byte> small_asset(const TriangleMesh& mesh = make_torus(20, 12)) {
  return build_asset(mesh, small_build_options()).value().bytes;
}

inline std::string as_text(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace fanstream::testing
