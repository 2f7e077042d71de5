#include "client/reduce/mesh_reduction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "client/reduce/edge_reducer.h"
#include "common/mesh/manifold_check.h"

namespace fanstream {
namespace {

constexpr std::size_t kMostTriangles = std::size_t{1} << 30U;
// Times the first count: from there on edges are taken in exact order.
constexpr std::size_t kExactFrom = 3;
constexpr VertexId kUnused = 0xFFFFFFFFU;

bool finite(const glm::dvec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

Result<void> check_counts(std::span<const std::size_t> counts) {
  if (counts.empty()) return fail(ErrorKind::usage, "no number of triangles to reduce to");
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] == 0) return fail(ErrorKind::usage, "0 triangles: at least 1 must be left");
    if (i > 0 && counts[i] >= counts[i - 1]) {
      return fail(ErrorKind::usage, std::to_string(counts[i]) + " triangles after " + std::to_string(counts[i - 1]) +
                                        ": give the numbers from large to small");
    }
  }
  return {};
}

Result<void> check_mesh(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return fail(ErrorKind::bad_input, "the mesh has no triangles");
  if (mesh.triangles.size() > kMostTriangles) return fail(ErrorKind::limit, "more than 2^30 triangles");
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    if (!finite(mesh.positions[v])) {
      return fail(ErrorKind::bad_input, "vertex " + std::to_string(v) + ": the position is not finite");
    }
  }
  std::string why;
  if (!is_oriented_manifold(mesh, &why)) {
    return fail(ErrorKind::bad_input, "the mesh is no oriented manifold: " + why + "; clean it first");
  }
  return {};
}

Result<void> check_attributes(const TriangleMesh& mesh, const CornerAttributes& attributes) {
  if (attributes.empty()) return {};
  const auto& uv = attributes.values.texture_coordinates;
  const auto& colors = attributes.values.colors;
  const std::size_t wedges = uv.empty() ? colors.size() : uv.size();
  if (!uv.empty() && !colors.empty() && uv.size() != colors.size()) {
    return fail(ErrorKind::bad_input, "there are " + std::to_string(uv.size()) + " texture coordinates, but " +
                                          std::to_string(colors.size()) + " colours");
  }
  if (attributes.wedges.size() != mesh.triangles.size()) {
    return fail(ErrorKind::bad_input, "attributes are given for " + std::to_string(attributes.wedges.size()) + " of " +
                                          std::to_string(mesh.triangles.size()) + " triangles");
  }
  for (std::size_t t = 0; t < attributes.wedges.size(); ++t) {
    for (const VertexId wedge : attributes.wedges[t]) {
      if (wedge < wedges) continue;
      return fail(ErrorKind::bad_input, "triangle " + std::to_string(t) + " names attributes " + std::to_string(wedge) +
                                            " of " + std::to_string(wedges));
    }
  }
  for (std::size_t w = 0; w < wedges; ++w) {
    const bool fine = (uv.empty() || (std::isfinite(uv[w].x) && std::isfinite(uv[w].y))) &&
                      (colors.empty() || (std::isfinite(colors[w].r) && std::isfinite(colors[w].g) &&
                                          std::isfinite(colors[w].b) && std::isfinite(colors[w].a)));
    if (!fine) return fail(ErrorKind::bad_input, "attributes " + std::to_string(w) + " are not finite");
  }
  return {};
}

}  // namespace

Result<void> reduce_mesh(const TriangleMesh& mesh, const CornerAttributes& attributes,
                         std::span<const std::size_t> triangle_counts, const ReductionOptions& options,
                         const LevelSink& sink) {
  if (auto checked = check_counts(triangle_counts); !checked) return checked;
  if (auto checked = check_mesh(mesh); !checked) return checked;
  if (auto checked = check_attributes(mesh, attributes); !checked) return checked;
  EdgeReducer reducer(mesh, attributes, options, kExactFrom * std::min(triangle_counts.front(), kMostTriangles));
  const std::size_t last = triangle_counts.back();
  const std::size_t all = std::max(mesh.triangles.size(), last);
  const auto go_on = [&] {
    if (!options.go_on) return true;
    const auto left = static_cast<double>(reducer.triangle_count() - std::min(last, reducer.triangle_count()));
    return options.go_on(all == last ? 1.0 : 1.0 - left / static_cast<double>(all - last));
  };
  const std::size_t step = std::max<std::size_t>(1, (all - last) / 200);
  for (const std::size_t count : triangle_counts) {
    while (reducer.triangle_count() > count) {
      if (!go_on()) return fail(ErrorKind::interrupted, "stopped by the user");
      const std::size_t before = reducer.triangle_count();
      if (!reducer.reduce_to(std::max(count, before - std::min(before, step)))) break;
    }
    ReducedLevel level;
    level.asked_triangles = count;
    if (reducer.triangle_count() > count) level.shortfall = reducer.shortfall();
    reducer.extract(level.mesh, level.attributes);
    if (auto taken = sink(std::move(level)); !taken) return taken;
  }
  return {};
}

VertexAttributedMesh split_at_seams(const TriangleMesh& mesh, const CornerAttributes& attributes) {
  VertexAttributedMesh split;
  split.mesh.triangles.reserve(mesh.triangles.size());
  if (attributes.empty()) {
    split.mesh = mesh;
    return split;
  }
  const VertexAttributes& values = attributes.values;
  const std::size_t wedges = std::max(values.texture_coordinates.size(), values.colors.size());
  // Most wedges belong to one vertex; those that several share are looked up.
  std::vector<VertexId> owner(wedges, kUnused), id(wedges, kUnused);
  std::map<std::array<VertexId, 2>, VertexId> shared;
  const auto add = [&](VertexId vertex, VertexId wedge) {
    const auto added = static_cast<VertexId>(split.mesh.positions.size());
    split.mesh.positions.push_back(mesh.positions[vertex]);
    if (!values.texture_coordinates.empty()) {
      split.attributes.texture_coordinates.push_back(values.texture_coordinates[wedge]);
    }
    if (!values.colors.empty()) split.attributes.colors.push_back(values.colors[wedge]);
    return added;
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Triangle corners{};
    for (std::size_t i = 0; i < 3; ++i) {
      const VertexId vertex = mesh.triangles[t][i];
      const VertexId wedge = attributes.wedges[t][i];
      if (owner[wedge] == kUnused) {
        owner[wedge] = vertex;
        id[wedge] = add(vertex, wedge);
      }
      if (owner[wedge] == vertex) {
        corners[i] = id[wedge];
      } else {
        const auto [at, is_new] = shared.try_emplace({vertex, wedge}, kUnused);
        if (is_new) at->second = add(vertex, wedge);
        corners[i] = at->second;
      }
    }
    split.mesh.triangles.push_back(corners);
  }
  return split;
}

}  // namespace fanstream
