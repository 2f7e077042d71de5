// The full model as its error is measured: on the grid, and in the order in which it lies in space.
#pragma once

#include <vector>

#include "common/grid/position_grid.h"
#include "common/mesh/triangle_mesh.h"
#include "server/build/faces_around.h"

namespace fanstream {

// Vertices are renumbered so that those close in space have close numbers, faces likewise: all of the model is worked
// through again and again, so what lies together is stored together. Keeps a reference to the grid. Threads may share
// one that does not change.
struct PlacedMesh {
  static constexpr std::uint32_t kFacesOfPart = 50'000;

  // `codes` are the places of the model's vertices, `triangles` its faces.
  PlacedMesh(const std::vector<Triangle>& triangles, std::vector<GridPoint> codes, const PositionGrid& grid,
             std::uint32_t faces_of_part = kFacesOfPart);

  // A large model is measured in parts, side by side: runs of faces, at most 4, of faces_of_part or more, whatever
  // processors there are.
  std::uint32_t part_count() const { return part_count_; }
  std::uint32_t part_begin(std::uint32_t part) const;  // a face; that of part_count() is the number of faces

  // In grid steps: whole numbers below 2^20, which floats hold exactly.
  glm::vec3 place_of(const GridPoint& code) const { return glm::vec3(grid.coordinates(code)); }

  const PositionGrid& grid;
  std::vector<GridPoint> codes;   // by vertex of the model
  std::vector<VertexId> number;   // by vertex of the model: its number here
  std::vector<glm::vec3> places;  // by number
  std::vector<Triangle> faces;    // of numbers
  FacesAround around;             // by number

 private:
  std::uint32_t part_count_ = 1;
  std::vector<VertexId> numbers_by_place() const;
  std::vector<Triangle> placed(const std::vector<Triangle>& triangles) const;
};

}  // namespace fanstream
