// The errors in a cell table hold for every mesh that a client may come to have.
#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>

#include "common/geometry/closest_point.h"
#include "common/geometry/triangle_tree.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/cleaned_shared_mesh.h"
#include "tests/support/measured_levels.h"

namespace fanstream {
namespace {

using testing::OpenAsset;
using testing::SeededRandom;

// What the cell table says of a mesh that is refined as far as the held segments allow.
struct StatedErrors {
  TriangleMesh mesh;
  struct Corner {
    double error = 0.0;
    CodedCone cone;
  };
  std::vector<std::array<Corner, 3>> by_triangle;  // its corners' cells
  double largest = 0.0;

  // How far a point of the full model with this normal may be from a triangle: cells speak for normals in their cones.
  double allowed(std::size_t triangle, const glm::dvec3& normal) const {
    double error = 0.0;
    for (const Corner& c : by_triangle[triangle]) {
      if (c.cone.holds(normal)) error = std::max(error, c.error);
    }
    return error;
  }
};

// The vertices that a cell has made in a mesh.
std::uint32_t made_by(const CellEntry& cell, const ProgressiveMesh& mesh) {
  std::uint32_t made = 0;
  for (std::uint32_t i = 0; i < cell.split_count; ++i)
    made += mesh.state().fans.contains(cell.first_vertex + i) ? 1 : 0;
  return made;
}

class AssetUnderTest {
 public:
  AssetUnderTest(const TriangleMesh& mesh, const BuildOptions& options)
      : asset_(testing::build_and_open(mesh, options)) {
    if (!asset_.head) return;
    full_ = testing::on_grid(mesh, asset_.head->grid);
    made_.resize(asset_.index->cells.size());
    const auto complete = testing::fully_refined(asset_);
    for (std::size_t layer = asset_.head->layer_ends.size(); layer-- > 0;) {
      complete->coarsen_to(asset_.head->layer_ends[layer]);
      for (std::uint32_t c = 0; c < made_.size(); ++c) {
        const CellEntry& cell = asset_.index->cells[c];
        const std::uint32_t begin = asset_.head->layer_begin(cell.slab);
        if (layer < begin || layer >= begin + cell.segment_count) continue;
        made_[c].insert(made_[c].begin(), made_by(cell, *complete));
      }
    }
  }

  const OpenAsset& asset() const { return asset_; }
  const TriangleMesh& full() const { return full_; }

  // A cell is as good as its first segment says of which something is missing.
  StatedErrors stated(const ProgressiveMesh& mesh) const {
    const AssetHead& head = *asset_.head;
    std::vector<double> by_cell(made_.size(), 0.0);
    for (std::uint32_t c = 0; c < made_.size(); ++c) {
      const CellEntry& cell = asset_.index->cells[c];
      const std::uint32_t made = made_by(cell, mesh);
      const auto missing = std::upper_bound(made_[c].begin(), made_[c].end(), made);
      if (missing == made_[c].end()) continue;
      const auto segment = cell.first_segment + static_cast<std::uint32_t>(missing - made_[c].begin());
      by_cell[c] = error_from_code(asset_.index->segments[segment].error_code, head.grid.step());
    }
    StatedErrors errors;
    const FanState& state = mesh.state();
    errors.mesh.triangles = state.fans.triangles();
    errors.mesh.positions.resize(state.vertices.size());
    for (const Triangle& t : errors.mesh.triangles) {
      std::array<StatedErrors::Corner, 3> corners;
      for (std::size_t i = 0; i < 3; ++i) {
        errors.mesh.positions[t[i]] = head.grid.decode(state.vertices[t[i]].place);
        if (by_cell.empty()) continue;
        const std::uint32_t cell = state.cells[t[i]];
        corners[i] = {by_cell[cell], asset_.index->cells[cell].cone};
        errors.largest = std::max(errors.largest, by_cell[cell]);
      }
      errors.by_triangle.push_back(corners);
    }
    return errors;
  }

 private:
  OpenAsset asset_;
  TriangleMesh full_;
  std::vector<std::vector<std::uint32_t>> made_;  // by cell and segment: what it has made with that
};

// Some segments of a random depth here and there: everything of the coarse layers, less and less of the finer ones.
std::unique_ptr<ProgressiveMesh> partly_refined(const OpenAsset& asset, SeededRandom& random) {
  auto mesh = testing::start(asset);
  const auto layers = static_cast<std::uint32_t>(asset.head->layer_ends.size());
  const std::uint32_t sure = layers == 0 ? 0 : random.below(layers);
  for (const auto& [cell, segment] : asset.segments()) {
    const std::uint32_t layer = asset.head->layer_begin(asset.index->cells[cell].slab) + segment;
    if (layer >= sure && random.one_in(3)) continue;
    EXPECT_TRUE(mesh->add_segment(cell, segment, asset.segment(cell, segment)));
  }
  EXPECT_TRUE(mesh->refine());
  return mesh;
}

double distance_to(const glm::dvec3& p, const TriangleMesh& mesh, const Triangle& t) {
  return glm::distance(p,
                       closest_point_on_triangle(p, mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]));
}

// Each point of the full model has a triangle that is no farther away than those of the triangle's own cells say whose
// cones hold its normal. Returns by how much the worst misses that, over all points of a pattern.
double worst_miss(const TriangleMesh& full, const StatedErrors& errors, const TriangleTree& tree,
                  std::uint32_t per_edge) {
  double worst = 0.0;
  std::uint32_t slot = 0;
  for (const Triangle& t : full.triangles) {
    const glm::dvec3 normal =
        glm::cross(full.positions[t[1]] - full.positions[t[0]], full.positions[t[2]] - full.positions[t[0]]);
    for (const glm::dvec3& p : testing::points_of(full, t, per_edge)) {
      slot = tree.closest(p, slot).slot;
      const std::uint32_t nearest = tree.triangle(slot);  // often that is it
      double miss = distance_to(p, errors.mesh, errors.mesh.triangles[nearest]) - errors.allowed(nearest, normal);
      for (std::size_t f = 0; f < errors.mesh.triangles.size() && miss > 0.0; ++f) {
        miss = std::min(miss, distance_to(p, errors.mesh, errors.mesh.triangles[f]) - errors.allowed(f, normal));
      }
      worst = std::max(worst, miss);
    }
  }
  return worst;
}

void expect_bounds_hold(const AssetUnderTest& tested, std::uint64_t seeds, std::uint32_t per_edge) {
  ASSERT_TRUE(tested.asset().head);
  const double rounding = 1e-9 * tested.asset().head->grid.step();
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const auto mesh = partly_refined(tested.asset(), random);
    const StatedErrors errors = tested.stated(*mesh);
    const auto tree = TriangleTree::build(errors.mesh);
    ASSERT_TRUE(tree);
    EXPECT_LE(worst_miss(tested.full(), errors, *tree, per_edge), rounding);
    double farthest = 0.0;
    std::uint32_t hint = 0;
    for (const Triangle& t : tested.full().triangles) {
      for (const glm::dvec3& p : testing::points_of(tested.full(), t, per_edge)) {
        const SurfacePoint nearest = tree->closest(p, hint);
        hint = nearest.slot;
        farthest = std::max(farthest, nearest.squared_distance);
      }
    }
    EXPECT_LE(std::sqrt(farthest), errors.largest + rounding);
  }
}

// Different quadrics make different histories: bounds hold of any.
class ErrorBound : public ::testing::TestWithParam<Quadrics> {
 protected:
  static BuildOptions options() {
    BuildOptions options = testing::small_cells();
    options.cost.quadrics = GetParam();
    return options;
  }
};

TEST_P(ErrorBound, HoldsInEveryPartlyRefinedMeshOfAllShapes) {
  for (const auto& [name, mesh] : testing::model_shapes()) {
    SCOPED_TRACE(name);
    expect_bounds_hold(AssetUnderTest(mesh, options()), 5, 3);
  }
}

TEST_P(ErrorBound, HoldsInPartlyRefinedMeshesOfRealModels) {
  for (const char* name : {"cow_2904v.off", "fandisk_13k.obj"}) {
    SCOPED_TRACE(name);
    const auto mesh = testing::cleaned_shared_mesh(name);
    if (!mesh) GTEST_SKIP() << "no shared data";
    expect_bounds_hold(AssetUnderTest(*mesh, options()), 4, 3);
  }
}

TEST_P(ErrorBound, ACompleteMeshHasNone) {
  for (const auto& [name, mesh] : testing::model_shapes()) {
    SCOPED_TRACE(name);
    const AssetUnderTest tested(mesh, options());
    ASSERT_TRUE(tested.asset().head);
    EXPECT_EQ(tested.stated(*testing::fully_refined(tested.asset())).largest, 0.0);
  }
}

INSTANTIATE_TEST_SUITE_P(Quadrics, ErrorBound, ::testing::Values(Quadrics::accumulated, Quadrics::memoryless),
                         [](const auto& quadrics) { return std::string(name_of(quadrics.param)); });

}  // namespace
}  // namespace fanstream
