#include "common/mesh/polygon_mesh.h"

#include <glm/geometric.hpp>

#include "common/mesh/polygon_triangulation.h"

namespace fanstream {
namespace {

glm::dvec3 cross_of(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) { return glm::cross(b - a, c - a); }

// The cosine of the fold along the diagonal from a to c; -1 where one side of it has no area.
double fold_cosine(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d) {
  const glm::dvec3 one = cross_of(a, b, c);
  const glm::dvec3 other = cross_of(a, c, d);
  const double lengths = glm::length(one) * glm::length(other);
  return lengths > 0 ? glm::dot(one, other) / lengths : -1.0;
}

void cut_quad(const std::vector<glm::dvec3>& places, std::span<const VertexId> quad, std::vector<Triangle>& triangles) {
  const auto place = [&](std::size_t i) { return places[quad[i]]; };
  if (fold_cosine(place(0), place(1), place(2), place(3)) >= fold_cosine(place(1), place(2), place(3), place(0))) {
    triangles.push_back({quad[0], quad[1], quad[2]});
    triangles.push_back({quad[0], quad[2], quad[3]});
  } else {
    triangles.push_back({quad[1], quad[2], quad[3]});
    triangles.push_back({quad[1], quad[3], quad[0]});
  }
}

}  // namespace

std::vector<glm::dvec3> positions(std::span<const glm::dvec4> points) {
  std::vector<glm::dvec3> places;
  places.reserve(points.size());
  for (const glm::dvec4& point : points) places.push_back(position(point));
  return places;
}

PolygonMesh polygon_mesh(const TriangleMesh& mesh) {
  PolygonMesh polygons;
  polygons.points.reserve(mesh.positions.size());
  for (const glm::dvec3& place : mesh.positions) polygons.points.emplace_back(place, 1.0);
  polygons.corners.reserve(3 * mesh.triangles.size());
  polygons.face_begins.reserve(mesh.triangles.size() + 1);
  for (const Triangle& triangle : mesh.triangles) polygons.add_face(triangle);
  return polygons;
}

TriangleMesh triangle_mesh(const PolygonMesh& mesh, std::vector<FaceId>* face_of_triangle) {
  TriangleMesh result;
  result.positions = positions(mesh.points);
  result.triangles.reserve(mesh.corners.size() - 2 * mesh.face_count());
  if (face_of_triangle != nullptr) face_of_triangle->clear();
  for (FaceId f = 0; f < mesh.face_count(); ++f) {
    const std::span<const VertexId> face = mesh.face(f);
    if (face.size() == 4) {
      cut_quad(result.positions, face, result.triangles);
    } else {
      triangulate_polygon(result.positions, face, result.triangles);
    }
    if (face_of_triangle != nullptr) face_of_triangle->resize(result.triangles.size(), f);
  }
  return result;
}

}  // namespace fanstream
