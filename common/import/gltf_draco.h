// Meshes compressed by Draco inside glTF (KHR_draco_mesh_compression).
#pragma once

#include <optional>
#include <string_view>

#include "common/import/input_file.h"
#include "common/import/mesh_import.h"

namespace fanstream {

struct DracoAttribute {
  std::uint32_t id = 0;     // Draco's unique id
  bool normalized = false;  // as the accessor has it: integers stand for [0, 1] or [-1, 1]
};
struct DracoAttributes {
  std::uint32_t position_id = 0;
  std::optional<DracoAttribute> texture_coordinates, colors;  // where they are wanted and there
};
struct DracoPrimitive {
  TriangleMesh mesh;
  VertexAttributes attributes;
};

// Decodes one compressed primitive. `what` names it in errors. Values are dequantised as Draco does it; indices are
// checked.
Result<DracoPrimitive> decode_draco_primitive(const InputFile& file, std::string_view bytes,
                                              const DracoAttributes& attributes, std::string_view what,
                                              const ImportOptions& options);

}  // namespace fanstream
