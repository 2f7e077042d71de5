#include "client/collision/surface_patch.h"

#include "client/collision/cell_hierarchy.h"

namespace fanstream {

void SurfacePatch::clear() {
  x.clear();
  y.clear();
  z.clear();
  numbers.clear();
  is_final.clear();
  triangles.clear();
  box = kNoBounds;
}

void SurfacePatch::add_vertex(VertexId number, const glm::dvec3& position, bool final) {
  x.push_back(position.x);
  y.push_back(position.y);
  z.push_back(position.z);
  numbers.push_back(number);
  is_final.push_back(final ? 1 : 0);
  box = united(box, {position, position});
}

SurfacePatch patch_of(const TriangleMesh& mesh) {
  SurfacePatch patch;
  patch.clear();
  for (VertexId v = 0; v < mesh.positions.size(); ++v) patch.add_vertex(v, mesh.positions[v], true);
  patch.triangles = mesh.triangles;
  return patch;
}

std::uint32_t PatchMaker::local(VertexId v, SurfacePatch& patch) {
  if (local_[v] == 0) {
    const FanVertex& vertex = state_.vertices[v];
    patch.add_vertex(v, grid_.decode(vertex.place), vertex.context.next == kNeverSplit);
    local_[v] = static_cast<std::uint32_t>(patch.vertex_count());
  }
  return local_[v] - 1;
}

void PatchMaker::make(const CellVertices& cell, SurfacePatch& patch) {
  patch.clear();
  local_.resize(state_.fans.vertex_capacity(), 0);
  const LinkedFans::Corner* const corners = state_.fans.corners();
  for (std::uint32_t i = 0; i < cell.count(); ++i) {
    const VertexId v = cell.at(i);
    LinkedFans::Corner corner = corners[state_.fans.corner(v)];
    VertexId first = corner.neighbour;
    for (std::uint32_t left = state_.fans.ring_size(v); left > 0; --left) {
      corner = corners[corner.next];
      const VertexId second = corner.neighbour;
      if (v < first && v < second && first != kOutside && second != kOutside) {
        patch.triangles.push_back({local(v, patch), local(first, patch), local(second, patch)});
      }
      first = second;
    }
  }
  for (const VertexId v : patch.numbers) local_[v] = 0;
}

}  // namespace fanstream
