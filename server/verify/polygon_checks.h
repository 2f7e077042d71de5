// Whether an asset's polygons are sound, and those of its input.
#pragma once

#include <string>

#include "common/asset/asset_file.h"
#include "common/import/mesh_cleaner.h"

namespace fanstream {

// Every block decodes, joins to faces that are discs, and there are as many as the section says. What was found, in a
// few words; or an Error that begins with the asset's name. "none" for an asset without polygons.
Result<std::string> check_polygon_section(const AssetFile& asset);

// Whether the asset has exactly those faces of more than three corners that the cleaned input has, corner for corner on
// the asset's grid. `cleaned` with its source_faces. Fails (bad_input) naming the first that differ.
Result<std::string> compare_polygons(const AssetFile& asset, const CleanedMesh& cleaned, const std::string& input_name);

}  // namespace fanstream
