#include "client/collision/live_surface.h"

#include <algorithm>
#include <numeric>

namespace fanstream {

bool operator==(const LiveSurface::Part& a, const LiveSurface::Part& b) {
  return a.triangles == b.triangles && a.box.low == b.box.low && a.box.high == b.box.high;
}

LiveSurface::LiveSurface(const ProgressiveMesh& mesh, const CellHierarchy& cells)
    : mesh_(mesh),
      cells_(cells),
      maker_(mesh.state(), mesh.head().grid),
      parts_(cells.node_count()),
      patches_(mesh.index().cells.size()) {
  if (!cells_.is_empty()) return;
  CellVertices all;
  all.initial.resize(mesh_.vertex_count());
  std::iota(all.initial.begin(), all.initial.end(), 0U);
  maker_.make(all, whole_);
  whole_part_ = {whole_.box, static_cast<std::uint32_t>(whole_.triangles.size())};
}

LiveSurface::Part LiveSurface::sum(std::uint32_t n) const {
  const CellHierarchy::Node& node = cells_.node(n);
  Part part;
  if (node.cell != CellHierarchy::kNone && !patches_[node.cell].triangles.empty()) {
    const SurfacePatch& patch = patches_[node.cell];
    return {patch.box, static_cast<std::uint32_t>(patch.triangles.size())};
  }
  for (const std::uint32_t below : node.below) {
    if (below == CellHierarchy::kNone) continue;
    part.box = united(part.box, parts_[below].box);
    part.triangles += parts_[below].triangles;
  }
  return part;
}

// A moving focus gives up as many cells as it takes up: their memory goes from one to the next.
void LiveSurface::give_back(SurfacePatch& patch) {
  constexpr std::size_t kMostSpare = 256;
  patch.clear();
  if (patch.x.capacity() != 0 && spare_.size() < kMostSpare) spare_.push_back(std::move(patch));
  patch = {};
}

void LiveSurface::update(std::span<const std::uint32_t> changed_cells) {
  for (const std::uint32_t c : changed_cells) {
    if (!mesh_.is_live(c)) give_back(patches_[c]);
  }
  for (const std::uint32_t c : changed_cells) {
    if (!mesh_.is_live(c)) continue;
    if (patches_[c].x.capacity() == 0 && !spare_.empty()) {
      patches_[c] = std::move(spare_.back());
      spare_.pop_back();
    }
    maker_.make(mesh_.vertices(c), patches_[c]);
  }
  for (const std::uint32_t c : changed_cells) {
    for (std::uint32_t n = cells_.node_of(c); n != CellHierarchy::kNone; n = cells_.node(n).parent) {
      const Part part = sum(n);
      if (part == parts_[n]) break;
      parts_[n] = part;
    }
  }
}

std::uint64_t LiveSurface::triangle_count() const {
  return cells_.is_empty() ? whole_part_.triangles : parts_[CellHierarchy::root()].triangles;
}

Bounds LiveSurface::box() const { return cells_.is_empty() ? whole_part_.box : parts_[CellHierarchy::root()].box; }

TriangleMesh LiveSurface::triangle_mesh(std::vector<bool>* original) const {
  if (original != nullptr) original->clear();
  std::vector<std::pair<VertexId, glm::dvec3>> vertices;
  std::vector<Triangle> triangles;
  triangles.reserve(triangle_count());
  visit([](const Part&) { return true; },
        [&](std::uint32_t, const SurfacePatch& patch) {
          for (std::uint32_t v = 0; v < patch.vertex_count(); ++v) {
            vertices.emplace_back(patch.numbers[v], patch.position(v));
          }
          for (std::size_t i = 0; i < patch.triangles.size(); ++i) {
            const auto& t = patch.triangles[i];
            triangles.push_back({patch.numbers[t[0]], patch.numbers[t[1]], patch.numbers[t[2]]});
            if (original != nullptr) original->push_back(patch.is_original(i));
          }
        });
  const auto less = [](const auto& a, const auto& b) { return a.first < b.first; };
  std::sort(vertices.begin(), vertices.end(), less);
  const auto same = [](const auto& a, const auto& b) { return a.first == b.first; };
  vertices.erase(std::unique(vertices.begin(), vertices.end(), same), vertices.end());
  TriangleMesh mesh;
  for (const auto& [number, position] : vertices) mesh.positions.push_back(position);
  for (Triangle& t : triangles) {
    for (VertexId& v : t) {
      const auto at = std::lower_bound(vertices.begin(), vertices.end(), std::pair(v, glm::dvec3(0.0)), less);
      v = static_cast<VertexId>(at - vertices.begin());
    }
  }
  mesh.triangles = std::move(triangles);
  return mesh;
}

}  // namespace fanstream
