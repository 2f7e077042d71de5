// Whether a view is so close to a model of so few triangles that all it sees is wanted at its finest: what smoothing
// needs, and what an error in pixels does not ask for.
#pragma once

#include <vector>

#include "client/view/cell_table.h"
#include "client/view/criteria.h"
#include "common/refine/progressive_mesh.h"

namespace fanstream {

// Not thread safe. References to the arguments are not kept.
class FinestNeed {
 public:
  // Triangles of the full model within the view take up so many pixels each, on the mean of the picture. The lower
  // number once it has been so, lest a hand that trembles change it.
  static constexpr double kPxPerTriangle = 8.0;
  static constexpr double kPxPerTriangleToStay = 6.0;

  FinestNeed(const AssetHead& head, const AssetIndex& index);

  // Adds up, over the live cells within the frustum, how many triangles they will have at their finest. Precondition:
  // view and criteria have passed their checks; table and mesh are of the same asset. Linear in the cells.
  bool decide(const View& view, const Criteria& criteria, const CellTable& table, const ProgressiveMesh& mesh);
  double finest_triangles() const { return finest_triangles_; }  // as of the last call

 private:
  std::vector<float> final_vertices_;  // by cell, those of its descendants
  double finest_triangles_ = 0.0;
  bool needed_ = false;
};

}  // namespace fanstream
