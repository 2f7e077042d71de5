// Meshes compressed by Draco inside glTF (KHR_draco_mesh_compression).
#pragma once

#include <string_view>

#include "common/import/input_file.h"
#include "common/import/mesh_import.h"

namespace fanstream {

// Decodes one compressed primitive; `position_id` is the unique id of Draco's position attribute. `what` names the
// primitive in errors. Positions are dequantised as Draco does it; indices are checked.
Result<TriangleMesh> decode_draco_primitive(const InputFile& file, std::string_view bytes, std::uint32_t position_id,
                                            std::string_view what, const ImportOptions& options);

}  // namespace fanstream
