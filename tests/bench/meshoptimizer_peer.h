// meshoptimizer 0.18's simplifier as the yardstick for shape quality at a given number of triangles.
#pragma once

#include <cstddef>

#include "common/mesh/triangle_mesh.h"
#include "common/support/result.h"

namespace fanstream::bench {

struct SimplifyOptions {
  std::size_t target_triangles = 0;
  bool lock_border = false;  // meshopt_SimplifyLockBorder; off is the library's default
};

struct SimplifyResult {
  TriangleMesh mesh;     // the vertices still used, at their original positions
  double seconds = 0.0;  // of meshopt_simplify alone
};

// Calls meshopt_simplify without an error limit. It keeps the topology and may stop above the target. It works in
// floats. Fails with bad_input for a mesh without triangles or with indices out of range.
Result<SimplifyResult> simplify_with_meshoptimizer(const TriangleMesh& mesh, const SimplifyOptions& options);

}  // namespace fanstream::bench
