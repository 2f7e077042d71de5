// The header of a PLY file: which elements of which properties follow in which encoding.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/import/input_file.h"

namespace fanstream {

enum class PlyType : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
inline bool is_integer(PlyType type) { return type != PlyType::float32 && type != PlyType::float64; }
inline std::size_t size_bytes(PlyType type) {
  constexpr std::size_t kSizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::float32;      // of the value, or of the values of a list
  PlyType count_type = PlyType::uint8;  // of the number of values in a list
  bool is_list = false;
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;  // as claimed, checked against nothing
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  enum class Encoding { text, little_endian, big_endian } encoding = Encoding::text;
  std::vector<PlyElement> elements;
  std::size_t size_bytes = 0;  // where the body begins
};

Result<PlyHeader> read_ply_header(const InputFile& file);

}  // namespace fanstream
