// The outer layers of glTF 2.0: the GLB chunks, the JSON text, and the bytes of buffers wherever they lie.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string_view>
#include <vector>

#include "common/import/input_file.h"

namespace fanstream {

struct GltfParts {
  std::string_view json;    // part of the file's bytes
  std::string_view binary;  // GLB's second chunk, empty where there is none
};
// For GLB its chunks, for anything else the whole file as JSON.
Result<GltfParts> split_gltf(const InputFile& file);

// Parses the JSON and leaves out what is not geometry (images, materials, animations, extras, ...), so that nothing of
// it is ever looked at. Values nested deeper than any glTF needs are dropped.
Result<nlohmann::json> parse_gltf_json(const InputFile& file, std::string_view json);

// The bytes of one buffer: a view of the file's binary chunk, or bytes of its own.
struct GltfBuffer {
  std::string_view view() const { return storage.empty() ? chunk : std::string_view(storage.data(), storage.size()); }
  std::string_view chunk;
  std::vector<char> storage;
};
// Reads every buffer that document["buffers"] lists: the GLB chunk, data URIs, files in the folder of `file` or below.
Result<std::vector<GltfBuffer>> load_gltf_buffers(const InputFile& file, const nlohmann::json& document,
                                                  std::string_view binary);

}  // namespace fanstream
