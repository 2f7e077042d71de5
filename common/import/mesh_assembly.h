// What the readers of polygon formats share: gathering vertices and faces in any order and making triangles of them.
#pragma once

#include <cmath>
#include <optional>
#include <span>
#include <string_view>

#include "common/import/mesh_import.h"

namespace fanstream {

// Why a position is refused ("is not a number", ...), or nothing where it is fine.
std::optional<std::string_view> position_fault(const glm::dvec3& position);

class MeshAssembly {
 public:
  explicit MeshAssembly(bool keep_polygons = false) : keep_polygons_(keep_polygons) {}

  bool keeps_polygons() const { return keep_polygons_; }
  void reserve(std::size_t vertices, std::size_t triangles);

  std::vector<glm::dvec3>& positions() { return mesh_.positions; }
  // Of the latest position; 1 where nothing is said. For the kept polygons only.
  void set_weight(double weight);
  void add_triangle(const Triangle& triangle) {
    if (keep_polygons_) polygons_.add_face(triangle);
    mesh_.triangles.push_back(triangle);
  }
  // Corners are checked and triangulated by finish(), when all positions are known. Polygons of one or two corners
  // draw nothing and are counted for a warning.
  void add_polygon(std::span<const VertexId> corners);
  // Triangles so far, and those that the polygons will give.
  std::size_t triangle_count() const { return mesh_.triangles.size() + polygon_triangles_; }

  // The mesh, once all indices are known to be in range. Appends to warnings what add_polygon() left out.
  TriangleMesh finish(std::vector<std::string>& warnings);
  // After finish(): ImportedMesh::source_faces.
  std::vector<std::uint32_t> source_faces() const;
  // After finish() and only where they are kept: the faces in the order in which they were added.
  PolygonMesh take_polygons() { return std::move(polygons_); }

 private:
  TriangleMesh mesh_;
  std::vector<VertexId> polygon_corners_;
  std::vector<std::uint32_t> polygon_sizes_;
  std::size_t polygon_triangles_ = 0;
  std::size_t plain_triangles_ = 0;  // known with finish(); they come first
  std::size_t too_small_polygons_ = 0;
  bool keep_polygons_ = false;
  PolygonMesh polygons_;
  std::vector<double> weights_;  // of the first vertices; none where all are 1
};

}  // namespace fanstream
