// Finds the builder's vertices again in a mesh that Draco has renumbered.
#pragma once

#include <vector>

#include "common/coding/base_coder.h"

namespace fanstream {

// For each vertex of `decoded`, the vertex of `original` that it is, by walking both meshes side by side. Vertices may share
// places. Fails if the two are not the same oriented mesh.
Result<std::vector<VertexId>> match_base(const BaseMesh& original, const BaseMesh& decoded);

}  // namespace fanstream
