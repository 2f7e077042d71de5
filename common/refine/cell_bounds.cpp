#include "common/refine/cell_bounds.h"

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace fanstream {
namespace {

constexpr double kSlack = 1e-9;       // of doubles, relative
constexpr double kConeSlack = 1e-6;  // of the cone's floats

class FaceVisitor {
 public:
  FaceVisitor(const FanState& state, std::uint32_t cell, const PositionGrid& grid, BoundsScratch& scratch)
      : state_(state), cell_(cell), grid_(grid), scratch_(scratch) {}

  // The vertex, its neighbours in other cells, and its faces, each at the smallest of its vertices of this cell.
  void visit(VertexId v) {
    const glm::dvec3 at = point(v);
    scratch_.points.push_back(at);
    LinkedFans::CornerId corner = state_.fans.corner(v);
    const LinkedFans::Corner* const corners = state_.fans.corners();
    const std::uint32_t size = state_.fans.ring_size(v);
    Neighbour first = neighbour(v, corners[corner].neighbour);
    const Neighbour start = first;
    for (std::uint32_t i = 0; i < size; ++i) {
      corner = corners[corner].next;
      const Neighbour second = i + 1 == size ? start : neighbour(v, corners[corner].neighbour);
      if (first.ours && second.ours) add_normal(first.at - at, second.at - at);
      first = second;
    }
  }

 private:
  struct Neighbour {
    glm::dvec3 at;
    bool ours;  // a face of it is to be looked at here
  };

  glm::dvec3 point(VertexId v) const { return grid_.decode(state_.vertices[v].place); }
  Neighbour neighbour(VertexId v, VertexId w) {
    if (w == kOutside) return {glm::dvec3(0.0), false};
    const bool foreign = state_.cells[w].cell != cell_;
    const Neighbour found{point(w), foreign || w > v};
    if (foreign) scratch_.points.push_back(found.at);
    return found;
  }
  void add_normal(const glm::dvec3& a, const glm::dvec3& b) {
    const glm::dvec3 normal = glm::cross(a, b);
    const double length = glm::length(normal);
    if (length > 0.0) scratch_.normals.push_back(normal / length);
  }

  const FanState& state_;
  std::uint32_t cell_;
  const PositionGrid& grid_;
  BoundsScratch& scratch_;
};

void bound_points(const std::vector<glm::dvec3>& points, CellBounds& bounds) {
  glm::dvec3 low = points.front();
  glm::dvec3 high = low;
  for (const glm::dvec3& p : points) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  bounds.centre = (low + high) * 0.5;
  double square = 0.0;
  for (const glm::dvec3& p : points) {
    const glm::dvec3 d = p - bounds.centre;
    square = std::max(square, glm::dot(d, d));
  }
  const glm::dvec3 size = glm::max(glm::abs(low), glm::abs(high));  // rounding of the coordinates themselves
  bounds.radius = std::sqrt(square) * (1.0 + kSlack) + kSlack * 1e-3 * (size.x + size.y + size.z);
}

void bound_normals(const std::vector<glm::dvec3>& normals, CellBounds& bounds) {
  glm::dvec3 sum(0.0);
  for (const glm::dvec3& n : normals) sum += n;
  const double length = glm::length(sum);
  if (!(length > 0.0)) return;
  const glm::dvec3 axis = sum / length;
  double cosine = 1.0;
  for (const glm::dvec3& n : normals) cosine = std::min(cosine, glm::dot(n, axis));
  bounds.cone_axis = glm::vec3(axis);
  bounds.cone_cosine = static_cast<float>(std::max(-1.0, cosine - kConeSlack));
}

}  // namespace

CellBounds cell_bounds(const FanState& state, const CellVertices& cell, const PositionGrid& grid,
                       BoundsScratch& scratch) {
  scratch.points.clear();
  scratch.normals.clear();
  FaceVisitor visitor(state, cell.cell, grid, scratch);
  for (std::uint32_t i = 0; i < cell.count(); ++i) visitor.visit(cell.at(i));
  CellBounds bounds;
  if (scratch.points.empty()) return bounds;
  bound_points(scratch.points, bounds);
  bound_normals(scratch.normals, bounds);
  return bounds;
}

}  // namespace fanstream
