// Attributes from what a file holds to the mesh that clean_mesh makes of it.
#pragma once

#include "common/mesh/vertex_attributes.h"

namespace fanstream {

// `attributes` of the vertices of `imported`, as import_mesh gives them, onto the corners of `cleaned`, which is what
// clean_mesh made of `imported`. Vertices that cleaning has welded keep their attributes side by side, as wedges of one
// vertex: that is a seam. Linear time.
CornerAttributes attributes_after_cleaning(const TriangleMesh& imported, VertexAttributes attributes,
                                           const TriangleMesh& cleaned);

}  // namespace fanstream
