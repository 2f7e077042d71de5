#include "common/refine/cell_bounds.h"

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace fanstream {
namespace {

// Relative to what is bounded; roundings are a millionth of it.
constexpr double kRadiusSlack = 1e-9;
constexpr double kCosineSlack = 1e-6;

// Goes through the vertices and faces of a cell.
class FaceVisitor {
 public:
  FaceVisitor(const FanState& state, const CellVertices& cell, const PositionGrid& grid, BoundsScratch& scratch)
      : state_(state), cell_(cell), grid_(grid), scratch_(scratch) {}

  void visit_all() {
    scratch_.points.clear();
    scratch_.normals.clear();
    for (std::uint32_t i = 0; i < cell_.count(); ++i) visit(cell_.at(i));
  }

 private:
  struct Neighbour {
    glm::dvec3 at;
    bool counts;  // a face of it is to be looked at here
  };

  glm::dvec3 point(VertexId v) const { return grid_.decode(state_.vertices[v].place); }

  // A face is looked at from the first of the cell's vertices in it, by number.
  Neighbour neighbour(VertexId v, VertexId w) {
    if (w == kOutside) return {glm::dvec3(0.0), false};
    const glm::dvec3 at = point(w);
    if (state_.cells[w] == cell_.cell) return {at, w > v};
    scratch_.points.push_back(at);
    return {at, true};
  }

  void visit(VertexId v) {
    const LinkedFans::Corner* const corners = state_.fans.corners();
    const glm::dvec3 at = point(v);
    scratch_.points.push_back(at);
    LinkedFans::Corner corner = corners[state_.fans.corner(v)];
    const Neighbour start = neighbour(v, corner.neighbour);
    Neighbour first = start;
    for (std::uint32_t left = state_.fans.ring_size(v); left > 0; --left) {
      corner = corners[corner.next];
      const Neighbour second = left == 1 ? start : neighbour(v, corner.neighbour);
      if (first.counts && second.counts) scratch_.normals.push_back(glm::cross(first.at - at, second.at - at));
      first = second;
    }
  }

  const FanState& state_;
  const CellVertices& cell_;
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
  const glm::dvec3 size = glm::max(glm::abs(low), glm::abs(high));  // which the coordinates are rounded by
  bounds.radius = std::sqrt(square) * (1.0 + kRadiusSlack) + 1e-15 * (size.x + size.y + size.z);
}

// Around the mean by area.
void bound_normals(const std::vector<glm::dvec3>& normals, CellBounds& bounds) {
  glm::dvec3 sum(0.0);
  for (const glm::dvec3& n : normals) sum += n;
  const double length = glm::length(sum);
  if (!(length > 0.0)) return;
  const glm::dvec3 axis = sum / length;
  double least = 1.0;  // cosine by its absolute value
  for (const glm::dvec3& n : normals) {
    const double along = glm::dot(n, axis);
    const double square = glm::dot(n, n);
    least = std::min(least, square > 0.0 ? along * std::abs(along) / square : 1.0);
  }
  const double cosine = std::copysign(std::sqrt(std::abs(least)), least);
  bounds.cone_axis = glm::vec3(axis);
  bounds.cone_cosine = static_cast<float>(std::max(-1.0, cosine - kCosineSlack));
}

}  // namespace

CellBounds cell_bounds(const FanState& state, const CellVertices& cell, const PositionGrid& grid,
                       BoundsScratch& scratch) {
  CellBounds bounds;
  if (cell.count() == 0) return bounds;
  FaceVisitor(state, cell, grid, scratch).visit_all();
  bound_points(scratch.points, bounds);
  bound_normals(scratch.normals, bounds);
  return bounds;
}

}  // namespace fanstream
