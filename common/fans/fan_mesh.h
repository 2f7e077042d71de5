// The paper's FanMesh (Suzuki, Okamoto, Kanai, section 4): a triangle mesh partitioned into triangle fans.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace fanstream {

struct Vertex {
  glm::vec3 point{0.0F};
  glm::vec3 normal{0.0F};  // unit length, or zero where it has not been computed
};

// A centre and an ordered run of its ring, counter-clockwise seen from outside. An open fan of f faces has f+1 ring
// vertices, a closed fan of f faces has f. Drawn as a GL triangle fan either issues f+2 vertices.
struct Fan {
  VertexId center = 0;
  std::uint32_t first = 0;  // into FanMesh::rings
  std::uint32_t count = 0;
  bool closed = false;
  std::uint32_t face_count() const { return closed ? count : count - 1; }
};

struct FanMesh {
  std::vector<Vertex> vertices;
  std::vector<Fan> fans;
  std::vector<VertexId> rings;  // the ring lists of all fans, one after another

  std::span<const VertexId> ring(const Fan& fan) const {
    return std::span<const VertexId>(rings).subspan(fan.first, fan.count);
  }
};

}  // namespace fanstream
