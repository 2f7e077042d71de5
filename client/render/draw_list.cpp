#include "client/render/draw_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>

namespace fanstream {
namespace {

constexpr std::size_t kMostIndices = std::numeric_limits<std::int32_t>::max();

bool finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

Result<void> check_fan(const FanMesh& mesh, std::size_t index) {
  const Fan& fan = mesh.fans[index];
  if (fan.count < 2 || fan.first > mesh.rings.size() || fan.count > mesh.rings.size() - fan.first) {
    return fail(ErrorKind::bad_input,
                fmt::format("fan {}: no {} ring vertices at {} of {}", index, fan.count, fan.first, mesh.rings.size()));
  }
  VertexId largest = fan.center;
  for (const VertexId vertex : mesh.ring(fan)) largest = std::max(largest, vertex);
  if (largest >= mesh.vertices.size()) {
    return fail(ErrorKind::bad_input,
                fmt::format("fan {} names vertex {} of {}", index, largest, mesh.vertices.size()));
  }
  return {};
}

Result<void> place_vertices(const FanMesh& mesh, DrawList& list) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Bounds bounds{glm::dvec3(kInfinity), glm::dvec3(-kInfinity)};
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Vertex& vertex = mesh.vertices[i];
    if (!finite(vertex.point)) return fail(ErrorKind::bad_input, fmt::format("vertex {}: the point is not finite", i));
    bounds.low = glm::min(bounds.low, glm::dvec3(vertex.point));
    bounds.high = glm::max(bounds.high, glm::dvec3(vertex.point));
  }
  if (mesh.vertices.empty()) return {};
  list.bounds = bounds;
  list.center = (bounds.low + bounds.high) / 2.0;
  list.radius = std::max(bounds.diagonal() / 2.0, 1e-300);
  list.vertices.reserve(mesh.vertices.size());
  for (const Vertex& vertex : mesh.vertices) {
    const glm::vec3 normal = finite(vertex.normal) ? vertex.normal : glm::vec3(0.0F);
    list.vertices.push_back({glm::vec3((glm::dvec3(vertex.point) - list.center) / list.radius), normal});
  }
  return {};
}

void append_fan(const FanMesh& mesh, const Fan& fan, DrawList& list) {
  const std::span<const VertexId> ring = mesh.ring(fan);
  const std::size_t begin = list.indices.size();
  list.indices.push_back(fan.center);
  list.indices.insert(list.indices.end(), ring.begin(), ring.end());
  if (fan.closed) list.indices.push_back(ring.front());
  list.fan_sizes.push_back(static_cast<std::int32_t>(list.indices.size() - begin));
  list.fan_offset_bytes.push_back(begin * sizeof(std::uint32_t));
}

void append_triangles(const FanMesh& mesh, const Fan& fan, DrawList& list) {
  const std::span<const VertexId> ring = mesh.ring(fan);
  for (std::size_t i = 0; i < fan.face_count(); ++i) {
    list.indices.insert(list.indices.end(), {fan.center, ring[i], ring[i + 1 == ring.size() ? 0 : i + 1]});
  }
}

}  // namespace

Result<DrawList> make_draw_list(const FanMesh& mesh, bool as_fans) {
  DrawList list;
  if (auto placed = place_vertices(mesh, list); !placed) return tl::unexpected(placed.error());
  std::size_t index_count = 0;
  for (std::size_t i = 0; i < mesh.fans.size(); ++i) {
    if (auto checked = check_fan(mesh, i); !checked) return tl::unexpected(checked.error());
    const std::size_t faces = mesh.fans[i].face_count();
    index_count += as_fans ? faces + 2 : 3 * faces;
    if (index_count > kMostIndices) {
      return fail(ErrorKind::limit, fmt::format("more than {} indices to draw; render a coarser level", kMostIndices));
    }
  }
  list.indices.reserve(index_count);
  for (const Fan& fan : mesh.fans) {
    if (as_fans) {
      append_fan(mesh, fan, list);
    } else {
      append_triangles(mesh, fan, list);
    }
  }
  return list;
}

}  // namespace fanstream
