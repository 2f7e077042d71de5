// Rings and faces in a form that can be compared, whatever order they are stored in.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "common/fans/fan_split.h"
#include "common/fans/ring_mesh.h"
#include "common/mesh/triangle_mesh.h"

namespace fanstream::testing {

// The ring turned so that its smallest number comes first.
inline std::vector<VertexId> as_cycle(std::span<const VertexId> ring) {
  std::vector<VertexId> cycle(ring.begin(), ring.end());
  std::rotate(cycle.begin(), std::min_element(cycle.begin(), cycle.end()), cycle.end());
  return cycle;
}

// All rings as cycles; vertices at the end that are not in the mesh are left off. Of a RingMesh or of LinkedFans.
template <class Mesh>
std::vector<std::vector<VertexId>> cycles_of(const Mesh& rings) {
  std::vector<std::vector<VertexId>> cycles;
  for (VertexId v = 0; v < rings.vertex_capacity(); ++v) cycles.push_back(as_cycle(rings.ring(v)));
  while (!cycles.empty() && cycles.back().empty()) cycles.pop_back();
  return cycles;
}

// The faces over the vertices that are there, numbered without gaps. Positions are all zero.
template <class Mesh>
TriangleMesh compact_faces(const Mesh& rings) {
  TriangleMesh mesh;
  std::vector<VertexId> number(rings.vertex_capacity(), 0);
  for (VertexId v = 0; v < number.size(); ++v) {
    if (!rings.contains(v)) continue;
    number[v] = static_cast<VertexId>(mesh.positions.size());
    mesh.positions.emplace_back(0.0);
  }
  mesh.triangles = rings.triangles();
  for (Triangle& t : mesh.triangles) {
    for (VertexId& v : t) v = number[v];
  }
  return mesh;
}

// The mesh without vertices that no face uses.
inline TriangleMesh without_unused(const TriangleMesh& mesh) {
  std::vector<VertexId> number(mesh.positions.size(), kOutside);
  TriangleMesh used;
  used.triangles = mesh.triangles;
  for (Triangle& t : used.triangles) {
    for (VertexId& v : t) {
      if (number[v] == kOutside) {
        number[v] = static_cast<VertexId>(used.positions.size());
        used.positions.push_back(mesh.positions[v]);
      }
      v = number[v];
    }
  }
  return used;
}

// Every face by the places of its corners, turned so that the smallest place comes first; sorted. Two meshes draw the
// same oriented faces exactly if these are equal, however they number vertices.
using FaceKey = std::array<std::array<double, 3>, 3>;
inline std::vector<FaceKey> face_keys(const TriangleMesh& mesh) {
  std::vector<FaceKey> keys;
  keys.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    FaceKey key;
    for (std::size_t c = 0; c < 3; ++c) {
      const glm::dvec3& p = mesh.positions[t[c]];
      key[c] = {p.x, p.y, p.z};
    }
    FaceKey best = key;
    for (int turn = 0; turn < 2; ++turn) {
      std::rotate(key.begin(), key.begin() + 1, key.end());
      best = std::min(best, key);
    }
    keys.push_back(best);
  }
  std::sort(keys.begin(), keys.end());
  return keys;
}

}  // namespace fanstream::testing
