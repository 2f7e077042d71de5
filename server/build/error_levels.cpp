#include "server/build/error_levels.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/support/cache_lines.h"
#include "server/build/patch_replay.h"
#include "server/build/patch_star.h"

namespace fanstream {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFU;

// How far patches are off at the vertices of a part of the full model.
class ReachPart {
 public:
  ReachPart(const PlacedMesh& mesh, std::uint32_t part) : part_(part), first_point_(mesh.faces.size(), kNone) {
    for (VertexId v = 0; v < mesh.places.size(); ++v) {
      const std::span<const std::uint32_t> around = mesh.around.of(v);
      if (around.empty()) continue;
      const std::uint32_t face = around.front();
      if (face < mesh.part_begin(part) || face >= mesh.part_begin(part + 1)) continue;
      points_.push_back({mesh.places[v], kNone});
      put(static_cast<std::uint32_t>(points_.size() - 1), face);
    }
  }

  // Generations must follow each other.
  void follow(const GenerationStars& stars) {
    reach_.resize(stars.numbers_end, 0.0F);
    for (std::size_t p = 0; p < stars.patches.size(); ++p) {
      if (!stars.patches[p].concerns(part_)) continue;
      fetch(stars, p);
      moving_.clear();
      for (const std::uint32_t f : stars.covered_by(p)) {
        for (std::uint32_t point = first_point_[f]; point != kNone; point = points_[point].next)
          moving_.push_back(point);
        first_point_[f] = kNone;
      }
      if (moving_.empty()) continue;
      star_.assign(stars, p);
      reach_[stars.patches[p].number] = move();
    }
  }

  const std::vector<float>& reach() const { return reach_; }  // by patch, in grid steps

 private:
  struct Point {
    glm::vec3 place;
    std::uint32_t next;  // of the same face
  };

  // What patches some way on will need.
  void fetch(const GenerationStars& stars, std::size_t patch) const {
    constexpr std::size_t kLists = 4;
    constexpr std::size_t kPoints = 2;
    if (patch + kLists < stars.patches.size()) {
      for (const std::uint32_t f : stars.covered_by(patch + kLists)) fetch_line(&first_point_[f]);
    }
    if (patch + kPoints < stars.patches.size()) {
      for (const std::uint32_t f : stars.covered_by(patch + kPoints)) {
        if (first_point_[f] != kNone) fetch_line(&points_[first_point_[f]]);
      }
    }
  }

  void put(std::uint32_t point, std::uint32_t face) {
    points_[point].next = first_point_[face];
    first_point_[face] = point;
  }

  float move() {
    distances_.resize(std::max<std::size_t>(distances_.size(), star_.distance().stored()));
    float squared = 0.0F;
    for (const std::uint32_t p : moving_) {
      const StarDistance::Nearest nearest =
          star_.distance().nearest(points_[p].place - star_.centre(), distances_.data());
      squared = std::max(squared, nearest.squared);
      put(p, star_.face(nearest.face));
    }
    return std::sqrt(squared);
  }

  std::uint32_t part_;
  std::vector<Point> points_;
  std::vector<std::uint32_t> first_point_;  // by face: lists of the points that it is the nearest to
  std::vector<float> reach_;

  // Of a patch.
  PatchStar star_;
  std::vector<std::uint32_t> moving_;
  std::vector<float> distances_;
};

// Which patches wait for which.
class WaitingPatches {
 public:
  explicit WaitingPatches(std::size_t faces) : made_by_(faces, kNone) {}

  void follow(const GenerationStars& stars) {
    for (std::size_t p = 0; p < stars.patches.size(); ++p) {
      const std::uint32_t number = stars.patches[p].number;
      for (const std::uint32_t f : stars.covered_by(p)) {
        const std::uint32_t before = made_by_[f];
        if (before == kNone || (!edges_.empty() && edges_.back().patch == number && edges_.back().waits == before))
          continue;
        edges_.push_back({number, before});
      }
      for (const GenerationStars::StarFace& f : stars.star_of(p)) made_by_[f.face] = number;
    }
  }

  // Neighbours follow each other in a generation, not numbers.
  void sort(std::size_t patches, std::vector<std::uint32_t>& begin, std::vector<std::uint32_t>& waiting) const {
    begin.assign(patches + 1, 0);
    for (const Edge& e : edges_) ++begin[e.patch + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::uint32_t> to = begin;
    waiting.resize(edges_.size());
    for (const Edge& e : edges_) waiting[to[e.patch]++] = e.waits;
  }

 private:
  struct Edge {
    std::uint32_t patch, waits;
  };
  std::vector<std::uint32_t> made_by_;  // by face: the last patch that has left it
  std::vector<Edge> edges_;
};

// Which patches wait for which, and how far off each is at the vertices of the full model.
struct PatchOrder {
  std::vector<float> reach;             // by patch, in grid steps
  std::vector<std::uint32_t> patch_of;  // by merge
  // Those that wait for a patch: waiting[waiting_begin[patch], waiting_begin[patch + 1]); their numbers are lower.
  std::vector<std::uint32_t> waiting_begin;
  std::vector<std::uint32_t> waiting;

  PatchOrder(const PlacedMesh& mesh, const CodedHistory& coded) {
    std::vector<ReachPart> parts;
    for (std::uint32_t p = 0; p < mesh.part_count(); ++p) parts.emplace_back(mesh, p);
    WaitingPatches waiting_patches(mesh.faces.size());
    PatchReplay replay(mesh, coded);
    replay.run(parts.size() + 1, [&](const GenerationStars& stars, std::size_t i) {
      if (i == parts.size()) {
        waiting_patches.follow(stars);
      } else {
        parts[i].follow(stars);
      }
    });
    patch_of = replay.patch_of_merge();
    reach.resize(parts[0].reach().size(), 0.0F);
    waiting_patches.sort(reach.size(), waiting_begin, waiting);
    for (std::uint32_t p = 0; p < reach.size(); ++p) {
      for (const ReachPart& part : parts) reach[p] = std::max(reach[p], part.reach()[p]);
      for (std::uint32_t i = waiting_begin[p]; i < waiting_begin[p + 1]; ++i)
        reach[p] = std::max(reach[p], reach[waiting[i]]);
    }
  }
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

MergeHistory level_by_error(const PlacedMesh& mesh, const CodedHistory& coded, const LevelOptions& options) {
  const PatchOrder order(mesh, coded);
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
