#include "tests/support/progressive_checks.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <map>
#include <set>

namespace fanstream::testing {
namespace {

// The finest generation that a cell may have by what is held and wanted.
std::uint32_t limit_of(const ProgressiveMesh& mesh, std::uint32_t cell) {
  const AssetHead& head = mesh.head();
  const CellEntry& entry = mesh.index().cells[cell];
  const std::uint32_t first = head.layer_begin(entry.slab);
  std::uint32_t limit = first == 0 ? 0 : head.layer_ends[first - 1];
  for (std::uint32_t s = 0; s < entry.segment_count && s < mesh.target(cell); ++s) {
    const bool empty = mesh.index().segments[entry.first_segment + s].size_bytes == 0;
    if (!empty && !mesh.holds(cell, s)) break;
    limit = head.layer_ends[first + s];
  }
  return limit;
}

// Whether a cell has nothing to wait for: all neighbours of its vertices that are split in a generation have had their
// coarser splits.
bool may_take(const ProgressiveMesh& mesh, std::uint32_t cell, std::uint32_t generation) {
  const FanState& state = mesh.state();
  for (VertexId v = 0; v < mesh.head().vertex_count; ++v) {
    if (!state.fans.contains(v) || state.cells[v] != cell || state.vertices[v].context.next != generation) continue;
    for (const VertexId w : state.fans.ring(v)) {
      if (w != kOutside && state.vertices[w].context.next < generation) return false;
    }
  }
  return true;
}

// On the grid, where that is exact: rounding gives any face a normal.
bool has_area(const ProgressiveMesh& mesh, const Triangle& t) {
  const auto at = [&](VertexId v) { return glm::dvec3(mesh.state().vertices[v].place); };
  return glm::cross(at(t[1]) - at(t[0]), at(t[2]) - at(t[0])) != glm::dvec3(0.0);
}

std::vector<Triangle> faces_of(const ProgressiveMesh& mesh) { return mesh.state().fans.triangles(); }

}  // namespace

Topology topology_of(const TriangleMesh& mesh) {
  std::set<std::pair<VertexId, VertexId>> edges;
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) edges.emplace(t[i], t[(i + 1) % 3]);
  }
  std::map<VertexId, VertexId> boundary;  // by the vertex they lead to, since each has one at most
  std::size_t undirected = 0;
  for (const auto& [a, b] : edges) {
    const bool open = !edges.contains({b, a});
    undirected += open || a < b ? 1 : 0;
    if (open) boundary.emplace(a, b);
  }
  Topology topology;
  topology.components = count_components(mesh.positions.size(), mesh.triangles);
  topology.euler_characteristic = static_cast<std::int64_t>(mesh.positions.size()) -
                                  static_cast<std::int64_t>(undirected) +
                                  static_cast<std::int64_t>(mesh.triangles.size());
  for (; !boundary.empty(); ++topology.boundary_loops) {
    for (auto at = boundary.begin(); at != boundary.end();) {
      const VertexId next = at->second;
      boundary.erase(at);
      at = boundary.find(next);
    }
  }
  return topology;
}

std::vector<std::vector<std::uint32_t>> cells_beside(const ProgressiveMesh& mesh) {
  std::vector<std::set<std::uint32_t>> beside(mesh.index().cells.size());
  for (const Triangle& t : faces_of(mesh)) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = mesh.state().cells[t[i]];
      const std::uint32_t b = mesh.state().cells[t[(i + 1) % 3]];
      if (a == b) continue;
      beside[a].insert(b);
      beside[b].insert(a);
    }
  }
  std::vector<std::vector<std::uint32_t>> result;
  for (const auto& cells : beside) result.emplace_back(cells.begin(), cells.end());
  return result;
}

::testing::AssertionResult is_largest_mesh(const ProgressiveMesh& mesh, std::span<const std::uint32_t> damaged) {
  const auto failure = [](std::uint32_t cell) { return ::testing::AssertionFailure() << "cell " << cell << ' '; };
  const auto beside = cells_beside(mesh);
  for (std::uint32_t c = 0; c < beside.size(); ++c) {
    const std::uint32_t done = mesh.applied_generation(c);
    const CellEntry& entry = mesh.index().cells[c];
    const std::uint32_t slab_end = mesh.head().layer_ends[mesh.head().slab_ends[entry.slab] - 1];
    const std::uint32_t parents = entry.slab == 0 ? 0 : mesh.applied_generation(entry.parent);
    const std::uint32_t slab_begin =
        entry.slab == 0 ? 0 : mesh.head().layer_ends[mesh.head().slab_ends[entry.slab - 1] - 1];
    const bool live = parents == slab_begin && (done < slab_end || entry.child_count == 0);
    if (live != mesh.is_live(c)) return failure(c) << "is_live() is wrong";
    if (done > std::max(limit_of(mesh, c), slab_begin)) return failure(c) << "is finer than is wanted or held";
    if (!live) {
      if (!beside[c].empty()) return failure(c) << "is not live but owns vertices";
      continue;
    }
    std::vector<std::uint32_t> known(mesh.neighbours(c).begin(), mesh.neighbours(c).end());
    std::sort(known.begin(), known.end());
    if (known != beside[c]) return failure(c) << "does not know its neighbours";
    const bool stops = done >= limit_of(mesh, c) || std::find(damaged.begin(), damaged.end(), c) != damaged.end();
    if (!stops && may_take(mesh, c, done + 1)) return failure(c) << "could take another generation than " << done;
  }
  return ::testing::AssertionSuccess();
}

::testing::AssertionResult bounds_hold(const ProgressiveMesh& mesh) {
  const auto failure = [](std::uint32_t cell) { return ::testing::AssertionFailure() << "cell " << cell << ": "; };
  std::vector<bool> has_face(mesh.index().cells.size());
  std::vector<CellBounds> all_bounds(has_face.size());
  for (std::uint32_t c = 0; c < all_bounds.size(); ++c) {
    if (mesh.is_live(c)) all_bounds[c] = mesh.bounds(c);
  }
  for (const Triangle& t : faces_of(mesh)) {
    std::array<glm::dvec3, 3> at;
    for (std::size_t i = 0; i < 3; ++i) at[i] = mesh.head().grid.decode(mesh.state().vertices[t[i]].place);
    const glm::dvec3 cross = glm::cross(at[1] - at[0], at[2] - at[0]);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t c = mesh.state().cells[t[i]];
      const CellBounds& bounds = all_bounds[c];
      has_face[c] = true;
      for (const glm::dvec3& p : at) {
        if (glm::length(p - bounds.centre) > bounds.radius) return failure(c) << "a corner is outside of its sphere";
      }
      if (!has_area(mesh, t)) continue;
      if (glm::dot(cross / glm::length(cross), glm::dvec3(bounds.cone_axis)) < bounds.cone_cosine) {
        return failure(c) << "a normal is outside of its cone";
      }
    }
  }
  for (std::uint32_t c = 0; c < has_face.size(); ++c) {
    if (mesh.is_live(c) && !has_face[c] && all_bounds[c].radius >= 0.0) return failure(c) << "has bounds but no face";
  }
  return ::testing::AssertionSuccess();
}

RefinedImage refined_image_of(const ProgressiveMesh& mesh) {
  RefinedImage image{image_of(mesh), std::vector<std::uint32_t>(mesh.head().vertex_count, 0), {}};
  const std::vector<VertexId> numbers = mesh.asset_numbers();
  for (const VertexId v : mesh.vertices_in_order()) image.cells[numbers[v]] = mesh.state().cells[v];
  for (std::uint32_t c = 0; c < mesh.index().cells.size(); ++c) image.generations.push_back(mesh.applied_generation(c));
  return image;
}

}  // namespace fanstream::testing
