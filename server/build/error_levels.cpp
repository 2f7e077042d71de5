#include "server/build/error_levels.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "server/build/patch_replay.h"

namespace fanstream {
namespace {

constexpr std::uint32_t kNone = PatchReplay::kNone;

// Which patches wait for which, and how far off each is at the vertices of the full model.
class PatchOrder {
 public:
  PatchOrder(const std::vector<Triangle>& triangles, std::vector<GridPoint> places, const PositionGrid& grid,
             const CodedHistory& coded)
      : mesh_(triangles, std::move(places), grid, coded),
        made_by_(mesh_.faces().size(), kNone),
        first_point_(mesh_.faces().size(), kNone) {
    assign_points();
    mesh_.run([&](std::uint32_t patches) { reach.resize(patches, 0.0F); }, [&](std::uint32_t patch) { visit(patch); });
    patch_of = mesh_.patch_of_merge();
    sort_waiting();
  }

  std::vector<float> reach;             // by patch, in grid steps
  std::vector<std::uint32_t> patch_of;  // by merge
  // Those that wait for a patch: waiting[waiting_begin[patch], waiting_begin[patch + 1]); their numbers are lower.
  std::vector<std::uint32_t> waiting_begin{0};
  std::vector<std::uint32_t> waiting;

 private:
  struct Edge {
    std::uint32_t patch, waits;
  };

  void assign_points() {
    points_.resize(mesh_.vertex_count());
    next_point_.assign(points_.size(), kNone);
    for (VertexId v = 0; v < points_.size(); ++v) points_[v] = mesh_.place(v);
    std::vector<bool> assigned(points_.size(), false);
    for (std::uint32_t f = 0; f < mesh_.faces().size(); ++f) {
      for (const VertexId v : mesh_.faces()[f].corners) {
        if (assigned[v]) continue;
        assigned[v] = true;
        next_point_[v] = first_point_[f];
        first_point_[f] = v;
      }
    }
  }

  void visit(std::uint32_t patch) {
    const StarDistance& star = mesh_.star();
    distances_.resize(std::max<std::size_t>(distances_.size(), star.stored()));
    moving_.clear();
    float& reach_here = reach[patch];
    for (const std::uint32_t f : mesh_.covered()) {
      const std::uint32_t before = made_by_[f];
      if (before != kNone && (edges_.empty() || edges_.back().patch != patch || edges_.back().waits != before)) {
        edges_.push_back({patch, before});
        reach_here = std::max(reach_here, reach[before]);
      }
      for (std::uint32_t p = first_point_[f]; p != kNone; p = next_point_[p]) moving_.push_back(p);
      first_point_[f] = kNone;
    }
    float squared = 0.0F;
    for (const std::uint32_t p : moving_) {
      const StarDistance::Nearest nearest = star.nearest(points_[p] - mesh_.centre(), distances_.data());
      squared = std::max(squared, nearest.squared);
      const std::uint32_t face = mesh_.star_faces()[nearest.face];
      next_point_[p] = first_point_[face];
      first_point_[face] = p;
    }
    reach_here = std::max(reach_here, std::sqrt(squared));
    for (const std::uint32_t f : mesh_.star_faces()) made_by_[f] = patch;
  }

  // Neighbours follow each other in a generation, not numbers.
  void sort_waiting() {
    waiting_begin.assign(reach.size() + 1, 0);
    for (const Edge& e : edges_) ++waiting_begin[e.patch + 1];
    std::partial_sum(waiting_begin.begin(), waiting_begin.end(), waiting_begin.begin());
    std::vector<std::uint32_t> to = waiting_begin;
    waiting.resize(edges_.size());
    for (const Edge& e : edges_) waiting[to[e.patch]++] = e.waits;
  }

  PatchReplay mesh_;
  std::vector<std::uint32_t> made_by_;      // by face: the last patch that has left it
  std::vector<std::uint32_t> first_point_;  // by face: lists of the points that it is the nearest to
  std::vector<std::uint32_t> next_point_;   // by point
  std::vector<glm::vec3> points_;           // the full model's vertices
  std::vector<Edge> edges_;
  std::vector<std::uint32_t> moving_;
  std::vector<float> distances_;
};

class Levels {
 public:
  Levels(const PatchOrder& order, const LevelOptions& options) : order_(order), level_(order.reach.size(), 0) {
    if (level_.empty()) return;
    find_fine(options.fine_share);
    double log_ratio = std::log(options.ratio);
    while (assign(log_ratio) > kMostGenerations) log_ratio *= 1.1;
  }
  const std::vector<std::uint32_t>& by_patch() const { return level_; }

 private:
  static constexpr double kDepthShare = 0.95;

  void find_fine(double share) {
    std::vector<float> sorted = order_.reach;
    const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(sorted.size() - 1));
    std::nth_element(sorted.begin(), at, sorted.end());
    fine_ = *at;
    std::vector<std::uint32_t> depths;
    for (std::uint32_t p = 0; p < level_.size(); ++p) {
      if (order_.reach[p] > fine_) continue;
      level_[p] = depth(p);
      depths.push_back(level_[p]);
    }
    const auto most =
        depths.begin() + static_cast<std::ptrdiff_t>(kDepthShare * static_cast<double>(depths.size() - 1));
    std::nth_element(depths.begin(), most, depths.end());
    coarse_begin_ = *most + 1;
  }

  std::uint32_t depth(std::uint32_t patch) const {
    std::uint32_t level = 0;
    for (std::uint32_t i = order_.waiting_begin[patch]; i < order_.waiting_begin[patch + 1]; ++i) {
      level = std::max(level, level_[order_.waiting[i]] + 1);
    }
    return level;
  }

  // Returns how many there are.
  std::uint32_t assign(double log_ratio) {
    std::uint32_t count = 0;
    for (std::uint32_t p = 0; p < level_.size(); ++p) {
      const float reach = order_.reach[p];
      std::uint32_t wanted = 0;
      if (reach > fine_) {
        const double octaves = std::log(static_cast<double>(reach) / std::max(fine_, 1e-6F)) / log_ratio;
        wanted = coarse_begin_ + static_cast<std::uint32_t>(octaves);
      }
      level_[p] = std::max(wanted, depth(p));
      count = std::max(count, level_[p] + 1);
    }
    return count;
  }

  const PatchOrder& order_;
  std::vector<std::uint32_t> level_;
  float fine_ = 0.0F;
  std::uint32_t coarse_begin_ = 0;
};

}  // namespace

MergeHistory level_by_error(const std::vector<Triangle>& triangles, std::vector<GridPoint> places,
                            const PositionGrid& grid, const CodedHistory& coded, const LevelOptions& options) {
  const PatchOrder order(triangles, std::move(places), grid, coded);
  const Levels levels(order, options);
  const MergeHistory& history = coded.history;
  const auto level_of = [&](std::size_t merge) { return levels.by_patch()[order.patch_of[merge]]; };
  std::vector<std::uint32_t> begin(1, 0);
  for (std::size_t m = 0; m < history.merges.size(); ++m) {
    begin.resize(std::max<std::size_t>(begin.size(), level_of(m) + 2), 0);
    ++begin[level_of(m) + 1];
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  MergeHistory result;
  result.base = history.base;
  result.base_vertices = history.base_vertices;
  result.merges.resize(history.merges.size());
  result.free_places.resize(history.free_places.size());
  std::vector<std::uint32_t> next = begin;
  for (std::size_t m = 0; m < history.merges.size(); ++m) {
    const std::uint32_t to = next[level_of(m)]++;
    result.merges[to] = history.merges[m];
    if (!history.free_places.empty()) result.free_places[to] = history.free_places[m];
  }
  begin.erase(std::unique(begin.begin(), begin.end()), begin.end());  // levels without merges
  result.generation_begin = std::move(begin);
  return result;
}

}  // namespace fanstream
