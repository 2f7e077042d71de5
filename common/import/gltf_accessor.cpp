#include "common/import/gltf_accessor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <type_traits>

#include "common/import/tinygltf.h"

namespace fanstream {
namespace {

std::size_t component_bytes(int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return 2;
    case TINYGLTF_COMPONENT_TYPE_INT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT: return 4;
    case TINYGLTF_COMPONENT_TYPE_DOUBLE: return 8;
    default: return 0;
  }
}

template <class T>
T load(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

template <class T>
double component(const char* at, bool normalized) {
  const auto value = static_cast<double>(load<T>(at));
  if constexpr (std::is_integral_v<T>) {
    if (normalized) return std::max(value / std::numeric_limits<T>::max(), -1.0);
  }
  return value;
}

double component(const char* at, int type, bool normalized) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE: return component<std::int8_t>(at, normalized);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return component<std::uint8_t>(at, normalized);
    case TINYGLTF_COMPONENT_TYPE_SHORT: return component<std::int16_t>(at, normalized);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return component<std::uint16_t>(at, normalized);
    case TINYGLTF_COMPONENT_TYPE_INT: return component<std::int32_t>(at, normalized);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT: return component<std::uint32_t>(at, normalized);
    case TINYGLTF_COMPONENT_TYPE_FLOAT: return component<float>(at, normalized);
    default: return component<double>(at, normalized);
  }
}

std::uint32_t index_at(const char* at, int type) {
  if (type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) return load<std::uint8_t>(at);
  if (type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) return load<std::uint16_t>(at);
  return load<std::uint32_t>(at);
}

bool is_index_type(int type) {
  return type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
         type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
}

}  // namespace

struct GltfAccessors::Values {
  const char* first = nullptr;  // null where the accessor has no buffer view: all zero
  std::size_t stride_bytes = 0;
  std::size_t count = 0;
};

tl::unexpected<Error> GltfAccessors::fail_accessor(int index, std::string_view what) const {
  return fail_in(file_, ErrorKind::bad_input, fmt::format("accessor {} {}", index, what));
}

Result<std::string_view> GltfAccessors::view_bytes(int view) const {
  const auto refuse = [&](std::string_view what) {
    return fail_in(file_, ErrorKind::bad_input, fmt::format("bufferView {} {}", view, what));
  };
  if (view < 0 || static_cast<std::size_t>(view) >= model_.bufferViews.size()) return refuse("does not exist");
  const tinygltf::BufferView& entry = model_.bufferViews[static_cast<std::size_t>(view)];
  if (entry.extensions.contains("EXT_meshopt_compression") || entry.extensions.contains("KHR_meshopt_compression")) {
    return fail_in(file_, ErrorKind::unsupported,
                   "is compressed by meshoptimizer, which cannot be read: export without it, or with Draco");
  }
  if (entry.buffer < 0 || static_cast<std::size_t>(entry.buffer) >= buffers_.size()) {
    return refuse(fmt::format("names buffer {}, which does not exist", entry.buffer));
  }
  const std::string_view bytes = buffers_[static_cast<std::size_t>(entry.buffer)].view();
  if (entry.byteOffset > bytes.size() || entry.byteLength > bytes.size() - entry.byteOffset) {
    return refuse(fmt::format("covers bytes {} to {}, but buffer {} has {}", entry.byteOffset,
                              entry.byteOffset + entry.byteLength, entry.buffer, bytes.size()));
  }
  return bytes.substr(entry.byteOffset, entry.byteLength);
}

Result<GltfAccessors::Values> GltfAccessors::locate(int index, int type, std::size_t element_bytes) const {
  const tinygltf::Accessor& accessor = model_.accessors[static_cast<std::size_t>(index)];
  if (accessor.type != type) return fail_accessor(index, "has the wrong number of components");
  Values values;
  values.count = accessor.count;
  if (accessor.count > options_.max_vertices) return fail_accessor(index, "has more values than the limit");
  if (accessor.bufferView < 0) {
    // All zero but for sparse values: no bytes vouch for the count, so it may not exceed what the file itself has.
    if (accessor.count > file_.bytes().size())
      return fail_accessor(index, "claims more values than the file has bytes");
    return values;
  }
  const Result<std::string_view> view = view_bytes(accessor.bufferView);
  if (!view) return tl::unexpected(view.error());
  const std::size_t stride = model_.bufferViews[static_cast<std::size_t>(accessor.bufferView)].byteStride;
  values.stride_bytes = stride == 0 ? element_bytes : stride;
  if (values.stride_bytes < element_bytes) return fail_accessor(index, "has a stride less than its elements");
  if (accessor.count == 0) return values;
  const std::size_t room = view->size() < accessor.byteOffset ? 0 : view->size() - accessor.byteOffset;
  if (room < element_bytes || (accessor.count - 1) > (room - element_bytes) / values.stride_bytes) {
    return fail_accessor(
        index, fmt::format("needs {} values of {} bytes from byte {} of bufferView {}, which has {} bytes: "
                           "the file is truncated or damaged",
                           accessor.count, element_bytes, accessor.byteOffset, accessor.bufferView, view->size()));
  }
  values.first = view->data() + accessor.byteOffset;
  return values;
}

Result<std::string_view> GltfAccessors::packed(int view, std::size_t offset, std::size_t count,
                                               std::size_t element_bytes, std::string_view what) const {
  const Result<std::string_view> bytes = view_bytes(view);
  if (!bytes) return bytes;
  if (offset > bytes->size() || count > (bytes->size() - offset) / element_bytes) {
    return fail_in(file_, ErrorKind::bad_input, fmt::format("{} reach beyond bufferView {}", what, view));
  }
  return bytes->substr(offset, count * element_bytes);
}

template <class Replace>
Result<void> GltfAccessors::apply_sparse(int index, std::size_t value_bytes, Replace replace) const {
  const tinygltf::Accessor& accessor = model_.accessors[static_cast<std::size_t>(index)];
  const auto& sparse = accessor.sparse;
  if (!sparse.isSparse) return {};
  const int type = sparse.indices.componentType;
  if (sparse.count < 0 || sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0 || !is_index_type(type)) {
    return fail_accessor(index, "has malformed sparse values");
  }
  const auto count = static_cast<std::size_t>(sparse.count);
  const Result<std::string_view> places =
      packed(sparse.indices.bufferView, static_cast<std::size_t>(sparse.indices.byteOffset), count,
             component_bytes(type), fmt::format("the sparse indices of accessor {}", index));
  if (!places) return tl::unexpected(places.error());
  const Result<std::string_view> values =
      packed(sparse.values.bufferView, static_cast<std::size_t>(sparse.values.byteOffset), count, value_bytes,
             fmt::format("the sparse values of accessor {}", index));
  if (!values) return tl::unexpected(values.error());
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t place = index_at(places->data() + i * component_bytes(type), type);
    if (place >= accessor.count) {
      return fail_accessor(index, fmt::format("has a sparse value for index {}, but {} values", place, accessor.count));
    }
    replace(place, values->data() + i * value_bytes);
  }
  return {};
}

template <std::size_t components>
Result<std::vector<std::array<double, components>>> GltfAccessors::numbers(int index, int type) const {
  if (index < 0 || static_cast<std::size_t>(index) >= model_.accessors.size()) {
    return fail_accessor(index, "does not exist");
  }
  const tinygltf::Accessor& accessor = model_.accessors[static_cast<std::size_t>(index)];
  const std::size_t size = component_bytes(accessor.componentType);
  if (size == 0) return fail_accessor(index, "has an unknown component type");
  const Result<Values> values = locate(index, type, components * size);
  if (!values) return tl::unexpected(values.error());
  std::vector<std::array<double, components>> numbers(values->count);
  const auto set = [&](std::size_t place, const char* at) {
    for (std::size_t c = 0; c < components; ++c) {
      numbers[place][c] = component(at + c * size, accessor.componentType, accessor.normalized);
    }
  };
  if (values->first != nullptr) {
    for (std::size_t i = 0; i < values->count; ++i) set(i, values->first + i * values->stride_bytes);
  }
  if (Result<void> done = apply_sparse(index, components * size, set); !done) return tl::unexpected(done.error());
  return numbers;
}

Result<std::vector<glm::dvec3>> GltfAccessors::positions(int index) const {
  const auto values = numbers<3>(index, TINYGLTF_TYPE_VEC3);
  if (!values) return tl::unexpected(values.error());
  std::vector<glm::dvec3> positions;
  positions.reserve(values->size());
  for (const auto& [x, y, z] : *values) positions.emplace_back(x, y, z);
  return positions;
}

Result<std::vector<glm::dvec2>> GltfAccessors::texture_coordinates(int index) const {
  const auto values = numbers<2>(index, TINYGLTF_TYPE_VEC2);
  if (!values) return tl::unexpected(values.error());
  std::vector<glm::dvec2> coordinates;
  coordinates.reserve(values->size());
  for (const auto& [u, v] : *values) coordinates.emplace_back(u, v);
  return coordinates;
}

Result<std::vector<glm::vec4>> GltfAccessors::colors(int index) const {
  const bool exists = index >= 0 && static_cast<std::size_t>(index) < model_.accessors.size();
  std::vector<glm::vec4> colors;
  if (exists && model_.accessors[static_cast<std::size_t>(index)].type == TINYGLTF_TYPE_VEC4) {
    const auto values = numbers<4>(index, TINYGLTF_TYPE_VEC4);
    if (!values) return tl::unexpected(values.error());
    colors.reserve(values->size());
    for (const auto& [r, g, b, a] : *values) colors.emplace_back(r, g, b, a);
    return colors;
  }
  const auto values = numbers<3>(index, TINYGLTF_TYPE_VEC3);
  if (!values) return tl::unexpected(values.error());
  colors.reserve(values->size());
  for (const auto& [r, g, b] : *values) colors.emplace_back(r, g, b, 1.0);
  return colors;
}

Result<std::vector<std::uint32_t>> GltfAccessors::indices(int index) const {
  if (index < 0 || static_cast<std::size_t>(index) >= model_.accessors.size()) {
    return fail_accessor(index, "does not exist");
  }
  const tinygltf::Accessor& accessor = model_.accessors[static_cast<std::size_t>(index)];
  if (!is_index_type(accessor.componentType)) return fail_accessor(index, "is not of an unsigned integer type");
  const std::size_t size = component_bytes(accessor.componentType);
  const Result<Values> values = locate(index, TINYGLTF_TYPE_SCALAR, size);
  if (!values) return tl::unexpected(values.error());
  std::vector<std::uint32_t> indices(values->count, 0);
  if (values->first != nullptr) {
    for (std::size_t i = 0; i < values->count; ++i) {
      indices[i] = index_at(values->first + i * values->stride_bytes, accessor.componentType);
    }
  }
  const auto replace = [&](std::size_t place, const char* value) {
    indices[place] = index_at(value, accessor.componentType);
  };
  if (Result<void> done = apply_sparse(index, size, replace); !done) return tl::unexpected(done.error());
  return indices;
}

}  // namespace fanstream
