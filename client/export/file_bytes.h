// What the writers of mesh files share: numbers as they lie in memory, places as floats where these hold them.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

namespace fanstream::detail {

static_assert(std::endian::native == std::endian::little, "the writers copy numbers as they lie in memory");

using Bytes = std::vector<std::uint8_t>;

template <class T>
void append(Bytes& bytes, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  const auto* begin = reinterpret_cast<const std::uint8_t*>(&value);
  bytes.insert(bytes.end(), begin, begin + sizeof value);
}

inline void append_text(Bytes& bytes, std::string_view text) { bytes.insert(bytes.end(), text.begin(), text.end()); }

// Whether x is finite and at most the largest float.
inline bool in_float_range(double x) { return std::abs(x) <= static_cast<double>(std::numeric_limits<float>::max()); }

// Whether floats hold all of them to the last bit.
inline bool exactly_floats(std::span<const glm::dvec3> places) {
  return std::all_of(places.begin(), places.end(), [](const glm::dvec3& p) {
    return in_float_range(p.x) && in_float_range(p.y) && in_float_range(p.z) && glm::dvec3(glm::vec3(p)) == p;
  });
}

inline void append_place(Bytes& bytes, const glm::dvec3& place, bool as_floats) {
  if (as_floats) {
    append(bytes, glm::vec3(place));
  } else {
    append(bytes, place);
  }
}

}  // namespace fanstream::detail
