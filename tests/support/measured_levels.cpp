#include "tests/support/measured_levels.h"

#include <algorithm>
#include <functional>
#include <map>

namespace fanstream::testing {
namespace {

SurfaceErrors measured(const MeasuredModel& model, std::uint32_t faces_of_part) {
  const CodedHistory coded(model.history, model.codes, model.grid);
  return measure_surface(PlacedMesh(model.mesh.triangles, model.codes, model.grid, faces_of_part), coded);
}

MergeHistory simplified(const TriangleMesh& mesh, std::uint32_t base_vertices, const CostOptions& cost) {
  SimplifyOptions options;
  options.cost = cost;
  options.base_vertices = base_vertices;
  return simplify(mesh, options);
}

// Splits patches from the base on, coarse to fine, where `wanted` and allowed.
class Refiner {
 public:
  explicit Refiner(const MeasuredModel& model)
      : model_(model), rings_(model.history.base), codes_(model.codes), pending_(codes_.size(), kOutside) {
    const MergeHistory& history = model.history;
    const CodedHistory coded(history, model.codes, model.grid);
    before_.resize(history.merges.size());
    for (std::uint32_t k = 0; k < history.generation_count(); ++k) {
      for (std::uint32_t m = history.generation_begin[k]; m < history.generation_begin[k + 1]; ++m) {
        const MergeRecord& merge = history.merges[m];
        before_[m] = codes_[merge.root];
        codes_[merge.root] = place_after_merge(codes_[merge.root], codes_[merge.removed], merge.parent,
                                               history.generation_count() - k, coded.shift(m));
      }
    }
  }

  void run(const std::function<bool(std::uint32_t generation)>& wanted) {
    const MergeHistory& history = model_.history;
    for (std::uint32_t k = history.generation_count(); k-- > 0;) {
      std::map<std::uint32_t, std::vector<std::uint32_t>> patches;  // merges of each, last first
      for (std::uint32_t m = history.generation_begin[k + 1]; m-- > history.generation_begin[k];) {
        patches[model_.errors.patch_of[m]].push_back(m);
      }
      for (const auto& [patch, merges] : patches) {
        const VertexId root = history.merges[merges.front()].root;
        if (!wanted(k) || !is_allowed(root)) {
          largest_pending_ = std::max(largest_pending_, model_.errors.patches[patch].error);
          if (rings_.contains(root) && pending_[root] == kOutside) pending_[root] = patch;
          continue;
        }
        for (const std::uint32_t m : merges) split(m);
      }
    }
  }

  MixedMesh result() const {
    MixedMesh mixed;
    mixed.mesh.triangles = rings_.triangles();
    for (const GridPoint& code : codes_) mixed.mesh.positions.push_back(model_.grid.decode(code));
    for (const Triangle& t : mixed.mesh.triangles) {
      // The coarsest patch: patches are numbered fine to coarse.
      std::uint32_t patch = kOutside;
      for (const VertexId v : t) {
        if (pending_[v] != kOutside && (patch == kOutside || pending_[v] > patch)) patch = pending_[v];
      }
      mixed.errors.push_back(patch == kOutside ? 0.0F : model_.errors.patches[patch].error);
    }
    mixed.largest_pending = largest_pending_;
    return mixed;
  }

 private:
  bool is_allowed(VertexId root) const {
    if (!rings_.contains(root) || pending_[root] != kOutside) return false;
    const auto ring = rings_.ring(root);
    return std::all_of(ring.begin(), ring.end(), [&](VertexId w) { return w == kOutside || pending_[w] == kOutside; });
  }

  void split(std::uint32_t m) {
    const MergeRecord& merge = model_.history.merges[m];
    rings_.split(merge.root, merge.removed, rings_.position_in_ring(merge.root, merge.first),
                 rings_.position_in_ring(merge.root, merge.last));
    codes_[merge.root] = before_[m];
  }

  const MeasuredModel& model_;
  RingMesh rings_;
  std::vector<GridPoint> codes_;
  std::vector<GridPoint> before_;       // by merge: the root's place before it
  std::vector<std::uint32_t> pending_;  // by vertex: its coarsest patch that is still merged
  float largest_pending_ = 0.0F;
};

}  // namespace

MeasuredModel::MeasuredModel(const TriangleMesh& model, int bits, std::uint32_t base_vertices, const CostOptions& cost,
                             std::uint32_t faces_of_part)
    : mesh(model), grid(PositionGrid::fit(model.positions, bits)), history(simplified(model, base_vertices, cost)) {
  for (const glm::dvec3& p : mesh.positions) codes.push_back(grid.encode(p));
  errors = measured(*this, faces_of_part);
}

TriangleMesh MeasuredModel::full() const {
  TriangleMesh full = mesh;
  for (std::size_t v = 0; v < codes.size(); ++v) full.positions[v] = grid.decode(codes[v]);
  return full;
}

MixedMesh uniform_level(const MeasuredModel& model, std::uint32_t merged_generations) {
  Refiner refiner(model);
  refiner.run([&](std::uint32_t generation) { return generation >= merged_generations; });
  return refiner.result();
}

MixedMesh mixed_level(const MeasuredModel& model, std::uint32_t skip_one_in, SeededRandom& random) {
  Refiner refiner(model);
  refiner.run([&](std::uint32_t) { return !random.one_in(skip_one_in); });
  return refiner.result();
}

std::vector<glm::dvec3> points_of(const TriangleMesh& mesh, const Triangle& triangle, std::uint32_t per_edge) {
  const glm::dvec3& a = mesh.positions[triangle[0]];
  const glm::dvec3 u = mesh.positions[triangle[1]] - a;
  const glm::dvec3 v = mesh.positions[triangle[2]] - a;
  std::vector<glm::dvec3> points;
  for (std::uint32_t i = 0; i <= per_edge; ++i) {
    for (std::uint32_t j = 0; i + j <= per_edge; ++j) {
      points.push_back(a + u * (static_cast<double>(i) / per_edge) + v * (static_cast<double>(j) / per_edge));
    }
  }
  return points;
}

}  // namespace fanstream::testing
