// Whether an asset keeps what it promises: each check refines the model for real and looks at the outcome.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/asset/asset_file.h"

namespace fanstream {

struct AssetCheck {
  std::string name;  // "refinement"
  std::function<Result<std::string>()>
      run;  // what was found, in a few words; or an Error that begins with the asset's name
};

// In this order (an asset that could be opened has the right digest and counts that add up):
// - checksums: every segment's own
// - refinement: all segments together give the stated number of vertices, triangles and components, and a manifold
// - order: the same segments in another (seeded) order, refined after each few, give the same mesh: nothing depends on
// more than
//   its stated dependencies
// - coarsening: undoing every split gives back FM0 exactly, and refining again the full model
// - bounds: the stated errors never grow from a segment to a finer one, nor from a cell to its children, and no sampled
// point of any
//   level lies farther from the full model than the level's bound
// - polygons: if there are any, every block of them decodes, and all faces are as many as the section says
// The checks refer to the asset, which must outlive them. Each takes as long as decoding the model once or twice.
std::vector<AssetCheck> asset_checks(const AssetFile& asset);

}  // namespace fanstream
