#include "common/import/mesh_assembly.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "common/mesh/polygon_triangulation.h"

namespace fanstream {

std::optional<std::string_view> position_fault(const glm::dvec3& position) {
  if (std::abs(position.x) <= kMaxCoordinate && std::abs(position.y) <= kMaxCoordinate &&
      std::abs(position.z) <= kMaxCoordinate) {
    return std::nullopt;
  }
  for (const double x : {position.x, position.y, position.z}) {
    if (std::isnan(x)) return "has a coordinate that is not a number (NaN)";
  }
  for (const double x : {position.x, position.y, position.z}) {
    if (std::isinf(x)) return "has an infinite coordinate";
  }
  return "has a coordinate beyond 1e30: scale the model down";
}

void MeshAssembly::reserve(std::size_t vertices, std::size_t triangles) {
  mesh_.positions.reserve(vertices);
  mesh_.triangles.reserve(triangles);
}

void MeshAssembly::set_weight(double weight) {
  if (weights_.empty() && weight == 1.0) return;
  weights_.resize(mesh_.positions.size(), 1.0);
  weights_.back() = weight;
}

void MeshAssembly::add_polygon(std::span<const VertexId> corners) {
  if (corners.size() < 3) {
    ++too_small_polygons_;
    return;
  }
  if (keep_polygons_) polygons_.add_face(corners);
  if (corners.size() == 3) {
    mesh_.triangles.push_back({corners[0], corners[1], corners[2]});
  } else {
    polygon_corners_.insert(polygon_corners_.end(), corners.begin(), corners.end());
    polygon_sizes_.push_back(static_cast<std::uint32_t>(corners.size()));
    polygon_triangles_ += corners.size() - 2;
  }
}

TriangleMesh MeshAssembly::finish(std::vector<std::string>& warnings) {
  plain_triangles_ = mesh_.triangles.size();
  mesh_.triangles.reserve(triangle_count());
  std::size_t first = 0;
  for (const std::uint32_t size : polygon_sizes_) {
    triangulate_polygon(mesh_.positions, std::span(polygon_corners_).subspan(first, size), mesh_.triangles);
    first += size;
  }
  if (too_small_polygons_ > 0) {
    warnings.push_back(fmt::format("{} faces of fewer than three corners were ignored.", too_small_polygons_));
  }
  if (keep_polygons_) {
    weights_.resize(mesh_.positions.size(), 1.0);
    polygons_.points.reserve(mesh_.positions.size());
    for (std::size_t i = 0; i < weights_.size(); ++i) {
      polygons_.points.emplace_back(mesh_.positions[i] * weights_[i], weights_[i]);
    }
  }
  return std::move(mesh_);
}

std::vector<std::uint32_t> MeshAssembly::source_faces() const {
  if (polygon_sizes_.empty()) return {};
  std::vector<std::uint32_t> faces(plain_triangles_ + polygon_triangles_);
  std::iota(faces.begin(), faces.begin() + static_cast<std::ptrdiff_t>(plain_triangles_), 0U);
  std::size_t at = plain_triangles_;
  auto face = static_cast<std::uint32_t>(plain_triangles_);
  for (const std::uint32_t size : polygon_sizes_) {
    std::fill_n(faces.begin() + static_cast<std::ptrdiff_t>(at), size - 2, face++);
    at += size - 2;
  }
  return faces;
}

}  // namespace fanstream
