// Small valid assets, built anew by each run of a fuzz target, so that they are of the format's current version.
#pragma once

#include <cstdio>
#include <cstdlib>

#include "common/asset/asset_file.h"
#include "common/import/mesh_cleaner.h"
#include "server/build/asset_builder.h"
#include "tests/support/mesh_generators.h"

namespace fanstream::testing {

// source_faces: as BuildOptions', of a mesh that is clean already.
inline std::vector<std::byte> build_small_asset(TriangleMesh mesh, int position_bits,
                                                const std::vector<std::uint32_t>& source_faces = {}) {
  BuildOptions options;
  options.position_bits = position_bits;
  options.base_vertices = 24;  // several slabs and generations in spite of the size
  options.cell_vertices = 12;
  options.segment_splits = 8;
  options.slab_growth = 3.5;
  options.source_faces = source_faces;
  options.paged_cells = 1;
  const Result<BuiltAsset> built = build_asset(clean_mesh(std::move(mesh)).mesh, options);
  if (!built) {
    std::fprintf(stderr, "%s\n", built.error().message.c_str());
    std::abort();
  }
  return built->bytes;
}

// Closed, with a handle, with a boundary, of two parts, without a split, of polygons.
inline std::vector<std::vector<std::byte>> build_small_assets() {
  TriangleMesh two = make_sphere(8, 10);
  append(two, make_open_cylinder(9, 6), {3.0, 0.0, 0.0});
  const TriangleMesh torus = make_torus(20, 12);
  std::vector<std::uint32_t> faces(torus.triangles.size());  // quads, some of them joined, some not
  for (std::uint32_t t = 0; t < faces.size(); ++t) faces[t] = t % 14 == 5 ? t + 1000 : t / 14 % 3 == 0 ? t / 4 : t / 2;
  return {build_small_asset(make_sphere(18, 24), 8),      build_small_asset(make_torus(20, 12), 10),
          build_small_asset(make_terrain(18, 16, 1), 12), build_small_asset(two, 8),
          build_small_asset(make_grid(1, 1), 6),          build_small_asset(torus, 10, faces)};
}

}  // namespace fanstream::testing
