// A model simplified and measured, and the meshes between its base and itself, as tests of error bounds need them.
#pragma once

#include "common/geometry/triangle_tree.h"
#include "server/build/surface_error.h"
#include "tests/support/seeded_random.h"

namespace fanstream::testing {

struct MeasuredModel {
  TriangleMesh mesh;
  PositionGrid grid;
  std::vector<GridPoint> codes;  // of the full model
  MergeHistory history;
  SurfaceErrors errors;

  MeasuredModel(const TriangleMesh& model, int bits, std::uint32_t base_vertices, const CostOptions& cost = {},
                std::uint32_t faces_of_part = PlacedMesh::kFacesOfPart);
  TriangleMesh full() const;
};

// What stands between the base and the full model when some patches are split and others are not.
struct MixedMesh {
  TriangleMesh mesh;
  std::vector<float> errors;     // by triangle: of the patch that made it, 0 for one of the full model's
  float largest_pending = 0.0F;  // of all patches that are merged
};

// All patches of generations finer than the given number of generations (as the builder counts, finest first) are
// split.
MixedMesh uniform_level(const MeasuredModel& model, std::uint32_t merged_generations);
// Each patch that may be split (CODING.md, section 9) is, but for one in `skip_one_in`.
MixedMesh mixed_level(const MeasuredModel& model, std::uint32_t skip_one_in, SeededRandom& random);

// Points all over a triangle: its corners, its edges, its inside.
std::vector<glm::dvec3> points_of(const TriangleMesh& mesh, const Triangle& triangle, std::uint32_t per_edge);

}  // namespace fanstream::testing
