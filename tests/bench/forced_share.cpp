#include "tests/bench/forced_share.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "tests/bench/asset_replay.h"

namespace fanstream::bench {

struct SplitDependencies::Recorder {
  const AssetHead& head;
  std::vector<Cell>& cells;
  std::vector<Step>& latest;

  void cells_started(std::uint32_t slab, const std::vector<CellVertices>& started, const FanState& /*state*/) {
    const std::uint32_t start = slab == 0 ? 0 : head.layer_ends[head.slab_ends[slab - 1] - 1];
    const std::uint32_t end = head.layer_ends[head.slab_ends[slab] - 1];
    for (const CellVertices& vertices : started) {
      Cell& cell = cells[vertices.cell];
      cell.start = start;
      cell.dependencies.resize(end - start);
      cell.splits.resize(end - start);
    }
  }

  void before_split(std::uint32_t cell, std::uint32_t generation, VertexId root, const RingGeometry& ring) {
    auto& dependencies = cells[cell].dependencies[generation - cells[cell].start - 1];
    const auto need = [&](VertexId v) {
      const Step step = latest[v];
      if (step.generation == 0 || step.cell == cell) return;
      for (Step& known : dependencies) {
        if (known.cell != step.cell) continue;
        known.generation = std::max(known.generation, step.generation);
        return;
      }
      dependencies.push_back(step);
    };
    need(root);
    for (std::uint32_t i = 0; i < ring.size(); ++i) {
      if (ring.id(i) != kOutside) need(ring.id(i));
    }
  }

  void after_split(std::uint32_t cell, std::uint32_t generation, VertexId root, VertexId added) {
    latest[root] = latest[added] = {cell, generation};
    ++cells[cell].splits[generation - cells[cell].start - 1];
  }
};

Result<SplitDependencies> SplitDependencies::of(std::shared_ptr<const OpenAsset> asset) {
  SplitDependencies result;
  result.asset_ = std::move(asset);
  result.cells_.resize(result.asset_->cell_count());
  result.latest_.resize(result.asset_->vertex_count());
  const std::vector<std::uint32_t> everything(result.cells_.size(), result.asset_->asset_head()->generation_count());
  Recorder recorder{*result.asset_->asset_head(), result.cells_, result.latest_};
  Result<FanState> full = replay_asset(*result.asset_, everything, recorder);
  if (!full) return tl::unexpected(full.error());
  result.full_ = std::move(*full);
  return result;
}

std::vector<std::uint32_t> SplitDependencies::needed(std::span<const VertexId> vertices) const {
  std::vector<std::uint32_t> need(cells_.size(), 0);
  std::vector<Step> open;
  for (const VertexId v : vertices) {
    open.push_back(latest_[v]);
    for (const VertexId w : full_.fans.ring(v)) {
      if (w != kOutside) open.push_back(latest_[w]);
    }
  }
  while (!open.empty()) {
    const Step step = open.back();
    open.pop_back();
    if (step.generation == 0 || need[step.cell] >= step.generation) continue;
    const Cell& cell = cells_[step.cell];
    if (need[step.cell] == 0 && cell.start > 0) {
      open.push_back({asset_->asset_index()->cells[step.cell].parent, cell.start});
    }
    for (std::uint32_t g = std::max(need[step.cell], cell.start) + 1; g <= step.generation; ++g) {
      const std::vector<Step>& dependencies = cell.dependencies[g - cell.start - 1];
      open.insert(open.end(), dependencies.begin(), dependencies.end());
    }
    need[step.cell] = step.generation;
  }
  return need;
}

double SplitDependencies::split_share(std::span<const std::uint32_t> needed) const {
  std::uint64_t all = 0;
  std::uint64_t used = 0;
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    for (std::uint32_t i = 0; i < cells_[c].splits.size(); ++i) {
      all += cells_[c].splits[i];
      if (cells_[c].start + i + 1 <= needed[c]) used += cells_[c].splits[i];
    }
  }
  return all == 0 ? 0.0 : static_cast<double>(used) / static_cast<double>(all);
}

double SplitDependencies::byte_share(std::span<const std::uint32_t> needed) const {
  const AssetHead& head = *asset_->asset_head();
  std::uint64_t all = 0;
  std::uint64_t used = 0;
  for (std::uint32_t c = 0; c < cells_.size(); ++c) {
    const std::uint32_t layer_begin = head.layer_begin(asset_->asset_index()->cells[c].slab);
    for (std::uint32_t s = 0; s < asset_->asset_index()->cells[c].segment_count; ++s) {  // no pages
      const std::size_t size = asset_->segment(c, s).size();
      all += size;
      if (needed[c] >= head.first_generation(layer_begin + s)) used += size;
    }
  }
  return all == 0 ? 0.0 : static_cast<double>(used) / static_cast<double>(all);
}

namespace {

double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11U) * 0x1p-53; }

struct Surface {
  std::vector<glm::dvec3> positions;
  std::vector<Triangle> triangles;
  std::vector<double> area_up_to;

  explicit Surface(const SplitDependencies& dependencies) : triangles(dependencies.full().fans.triangles()) {
    for (const GridPoint& place : dependencies.full().places()) {
      positions.push_back(dependencies.asset().asset_head()->grid.decode(place));
    }
    double sum = 0.0;
    for (const Triangle& t : triangles) {
      const glm::dvec3 edge = positions[t[1]] - positions[t[0]];
      sum += glm::length(glm::cross(edge, positions[t[2]] - positions[t[0]]));
      area_up_to.push_back(sum);
    }
  }

  glm::dvec3 random_point(std::mt19937_64& random) const {
    const double wanted = uniform(random) * area_up_to.back();
    const auto found = std::upper_bound(area_up_to.begin(), area_up_to.end(), wanted);
    const auto last = static_cast<std::ptrdiff_t>(triangles.size()) - 1;
    const Triangle& t = triangles[static_cast<std::size_t>(std::min(found - area_up_to.begin(), last))];
    const double a = std::sqrt(uniform(random));
    const double b = uniform(random);
    return (1.0 - a) * positions[t[0]] + a * (1.0 - b) * positions[t[1]] + a * b * positions[t[2]];
  }

  std::vector<VertexId> nearest(const glm::dvec3& point, std::size_t count) const {
    std::vector<std::pair<double, VertexId>> by_distance(positions.size());
    for (VertexId v = 0; v < positions.size(); ++v) {
      const glm::dvec3 offset = positions[v] - point;
      by_distance[v] = {glm::dot(offset, offset), v};
    }
    const auto end = by_distance.begin() + static_cast<std::ptrdiff_t>(count);
    std::nth_element(by_distance.begin(), end - 1, by_distance.end());
    std::vector<VertexId> vertices;
    for (auto it = by_distance.begin(); it != end; ++it) vertices.push_back(it->second);
    return vertices;
  }
};

}  // namespace

ForcedShare forced_share(const SplitDependencies& dependencies, double disc, std::uint32_t seeds,
                         std::uint64_t first_seed) {
  const Surface surface(dependencies);
  const auto total = static_cast<double>(surface.positions.size());
  const auto count = static_cast<std::size_t>(std::clamp(std::round(disc * total), 1.0, total));
  ForcedShare mean;
  for (std::uint32_t i = 0; i < seeds; ++i) {
    std::mt19937_64 random(first_seed + i);
    const std::vector<VertexId> vertices = surface.nearest(surface.random_point(random), count);
    const std::vector<std::uint32_t> needed = dependencies.needed(vertices);
    mean.splits += dependencies.split_share(needed) / seeds;
    mean.bytes += dependencies.byte_share(needed) / seeds;
  }
  mean.disc = static_cast<double>(count) / total;
  return mean;
}

}  // namespace fanstream::bench
