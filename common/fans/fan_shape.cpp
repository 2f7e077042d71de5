#include "common/fans/fan_shape.h"

namespace fanstream {

std::vector<Triangle> triangles_of(const FanMesh& mesh) {
  std::vector<Triangle> triangles;
  triangles.reserve(mesh.rings.size());
  for (const Fan& fan : mesh.fans) {
    const std::span<const VertexId> ring = mesh.ring(fan);
    for (std::size_t i = 0; i + 1 < ring.size(); ++i) triangles.push_back({fan.center, ring[i], ring[i + 1]});
    if (fan.closed) triangles.push_back({fan.center, ring.back(), ring.front()});
  }
  return triangles;
}

Result<FanMesh> make_fan_mesh(const TriangleMesh& mesh, CoverMethod method, const NormalOptions& options) {
  auto fans = cover_with_fans(mesh.positions.size(), mesh.triangles, method);
  if (!fans) return fans;
  const std::vector<glm::vec3> normals = vertex_normals(mesh.positions, mesh.triangles, options);
  fans->vertices.resize(mesh.positions.size());
  for (std::size_t i = 0; i < normals.size(); ++i) fans->vertices[i] = {glm::vec3(mesh.positions[i]), normals[i]};
  return fans;
}

FanMesh make_triangle_fans(const TriangleMesh& mesh, const NormalOptions& options) {
  FanMesh fans;
  fans.vertices.reserve(mesh.positions.size());
  for (const glm::dvec3& p : mesh.positions) fans.vertices.push_back({glm::vec3(p), glm::vec3(0.0F)});
  for (const Triangle& t : mesh.triangles) {
    fans.fans.push_back({t[0], static_cast<std::uint32_t>(fans.rings.size()), 2, false});
    fans.rings.insert(fans.rings.end(), {t[1], t[2]});
  }
  set_normals(fans, options);
  return fans;
}

void set_normals(FanMesh& mesh, const NormalOptions& options) {
  std::vector<glm::dvec3> positions;
  positions.reserve(mesh.vertices.size());
  for (const Vertex& vertex : mesh.vertices) positions.emplace_back(vertex.point);
  const std::vector<glm::vec3> normals = vertex_normals(positions, triangles_of(mesh), options);
  for (std::size_t i = 0; i < normals.size(); ++i) mesh.vertices[i].normal = normals[i];
}

}  // namespace fanstream
