// The whole model of an asset that is at hand, without a network.
#pragma once

#include <memory>

#include "common/asset/asset_file.h"
#include "common/refine/progressive_mesh.h"

namespace fanstream {

// Gives every segment to a new mesh and refines it fully. Fails if a segment cannot be decoded, or if the mesh is not
// complete afterwards; errors begin with the asset's name.
Result<std::unique_ptr<ProgressiveMesh>> load_full(const AssetFile& asset);

}  // namespace fanstream
