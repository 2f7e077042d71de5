// Typed values out of glTF buffers, every offset checked.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>
#include <vector>

#include "common/import/gltf_container.h"
#include "common/import/mesh_import.h"

namespace tinygltf {
class Model;
}

namespace fanstream {

class GltfAccessors {
 public:
  // Keeps references; all must outlive it.
  GltfAccessors(const InputFile& file, const ImportOptions& options, const tinygltf::Model& model,
                const std::vector<GltfBuffer>& buffers)
      : file_(file), options_(options), model_(model), buffers_(buffers) {}

  // The positions of accessor `index`: three components of any type, normalised where it says so, sparse values
  // applied.
  Result<std::vector<glm::dvec3>> positions(int index) const;
  // Two texture coordinates, three or four parts of a colour (opacity 1 where there are three), likewise.
  Result<std::vector<glm::dvec2>> texture_coordinates(int index) const;
  Result<std::vector<glm::vec4>> colors(int index) const;
  // The indices of accessor `index`: unsigned integers of 8, 16 or 32 bits.
  Result<std::vector<std::uint32_t>> indices(int index) const;
  // The bytes of a buffer view.
  Result<std::string_view> view_bytes(int view) const;

 private:
  struct Values;  // where the values of an accessor lie
  Result<Values> locate(int index, int type, std::size_t element_bytes) const;
  Result<std::string_view> packed(int view, std::size_t offset, std::size_t count, std::size_t element_bytes,
                                  std::string_view what) const;
  // Calls replace(index, bytes) for every sparse value.
  template <std::size_t components>
  Result<std::vector<std::array<double, components>>> numbers(int index, int type) const;
  template <class Replace>
  Result<void> apply_sparse(int index, std::size_t value_bytes, Replace replace) const;
  tl::unexpected<Error> fail_accessor(int index, std::string_view what) const;

  const InputFile& file_;
  const ImportOptions& options_;
  const tinygltf::Model& model_;
  const std::vector<GltfBuffer>& buffers_;
};

}  // namespace fanstream
