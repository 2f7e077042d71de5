#include "common/import/face_pairing.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <span>
#include <tuple>
#include <utility>

namespace fanstream {
namespace {

// Beyond this many faces at one edge, pairs are not chosen by shape: trying all pairs would take quadratic time.
constexpr std::size_t kMaxFacesPairedByShape = 32;

VertexId origin(const TriangleMesh& mesh, HalfEdge h) { return mesh.triangles[h / 3][h % 3]; }
VertexId target(const TriangleMesh& mesh, HalfEdge h) { return mesh.triangles[h / 3][next_in_triangle(h) % 3]; }
VertexId apex(const TriangleMesh& mesh, HalfEdge h) { return mesh.triangles[h / 3][previous_in_triangle(h) % 3]; }

// All half-edges, grouped by undirected edge.
class EdgeGroups {
 public:
  explicit EdgeGroups(const TriangleMesh& mesh) : first_(mesh.positions.size() + 1, 0) {
    const auto low = [&](HalfEdge h) { return std::min(origin(mesh, h), target(mesh, h)); };
    const auto count = static_cast<HalfEdge>(3 * mesh.triangles.size());
    keys_.resize(count);
    for (HalfEdge h = 0; h < count; ++h) ++first_[low(h) + 1];
    for (std::size_t v = 1; v < first_.size(); ++v) first_[v] += first_[v - 1];
    std::vector<HalfEdge> next(first_.begin(), first_.end() - 1);
    for (HalfEdge h = 0; h < count; ++h) {
      const std::uint64_t high = std::max(origin(mesh, h), target(mesh, h));
      keys_[next[low(h)]++] = high << 32U | h;
    }
    for (std::size_t v = 0; v + 1 < first_.size(); ++v)
      std::sort(keys_.begin() + first_[v], keys_.begin() + first_[v + 1]);
  }

  // Calls use(group) with the half-edges of each edge, by ascending number.
  template <class Use>
  void for_each(Use use) {
    for (std::size_t v = 0; v + 1 < first_.size(); ++v) {
      for (HalfEdge at = first_[v]; at < first_[v + 1];) {
        const std::uint64_t high = keys_[at] >> 32U;
        group_.clear();
        for (; at < first_[v + 1] && keys_[at] >> 32U == high; ++at) group_.push_back(static_cast<HalfEdge>(keys_[at]));
        use(std::span<HalfEdge>(group_));
      }
    }
  }

 private:
  std::vector<HalfEdge> first_;      // per vertex: its edges to greater vertices
  std::vector<std::uint64_t> keys_;  // the greater vertex and the half-edge
  std::vector<HalfEdge> group_;      // the one at hand
};

// Regions of faces joined so far, each with a parity: whether its faces must be reversed relative to the root region.
class RegionForest {
 public:
  explicit RegionForest(std::size_t count) : parent_(count), parity_(count, 0) {
    for (std::size_t i = 0; i < count; ++i) parent_[i] = static_cast<std::uint32_t>(i);
  }

  struct Place {
    std::uint32_t root;
    bool reversed;
  };

  Place find(std::uint32_t region) {
    std::uint32_t root = region;
    bool reversed = false;
    while (parent_[root] != root) {
      reversed ^= parity_[root] != 0;
      root = parent_[root];
    }
    const Place place{root, reversed};
    while (parent_[region] != root) {
      const std::uint32_t next = parent_[region];
      const bool next_reversed = reversed ^ (parity_[region] != 0);
      parent_[region] = root;
      parity_[region] = reversed ? 1 : 0;
      region = next;
      reversed = next_reversed;
    }
    return place;
  }

  void join(const Place& a, const Place& b, bool relative) {
    parent_[std::max(a.root, b.root)] = std::min(a.root, b.root);
    parity_[std::max(a.root, b.root)] = relative ? 1 : 0;
  }

 private:
  std::vector<std::uint32_t> parent_;
  std::vector<std::uint8_t> parity_;
};

class Pairer {
 public:
  Pairer(TriangleMesh& mesh, std::vector<std::uint32_t>* by_triangle)
      : mesh_(mesh), by_triangle_(by_triangle != nullptr && !by_triangle->empty() ? by_triangle : nullptr) {}

  FacePairing run() {
    EdgeGroups groups(mesh_);
    if (pair_all(groups)) return std::move(result_);
    remove_duplicates(groups);
    if (result_.duplicate_triangles > 0) groups = EdgeGroups(mesh_);
    result_.opposite.assign(3 * mesh_.triangles.size(), kNoHalfEdge);
    groups.for_each([this](std::span<HalfEdge> group) {
      if (group.size() == 2) join(group[0], group[1]);
    });
    grow_regions();
    RegionForest forest(region_count_);
    groups.for_each([&](std::span<HalfEdge> group) {
      if (group.size() > 2) pair_crowded_edge(group, forest);
    });
    settle_windings(forest);
    apply_flips();
    return std::move(result_);
  }

 private:
  void join(HalfEdge a, HalfEdge b) {
    result_.opposite[a] = b;
    result_.opposite[b] = a;
  }

  // Pairs the faces of a mesh that is well-formed as it is, as most are; false, with nothing paired, if it is not.
  bool pair_all(EdgeGroups& groups) {
    result_.opposite.assign(3 * mesh_.triangles.size(), kNoHalfEdge);
    bool well_formed = true;
    groups.for_each([&](std::span<HalfEdge> group) {
      if (!well_formed || group.size() == 1) return;
      well_formed = group.size() == 2 && origin(mesh_, group[0]) != origin(mesh_, group[1]) &&
                    apex(mesh_, group[0]) != apex(mesh_, group[1]);
      if (well_formed) join(group[0], group[1]);
    });
    if (!well_formed) result_.opposite.clear();
    return well_formed;
  }

  bool runs_up(HalfEdge h) const { return (origin(mesh_, h) < target(mesh_, h)) != flipped(h); }
  bool flipped(HalfEdge h) const { return flip_[h / 3] != 0; }

  void remove_duplicates(EdgeGroups& groups) {
    std::vector<std::uint8_t> dead(mesh_.triangles.size(), 0);
    const auto by_apex = [this](HalfEdge a, HalfEdge b) {
      const VertexId apex_a = apex(mesh_, a);
      const VertexId apex_b = apex(mesh_, b);
      return apex_a != apex_b ? apex_a < apex_b : a < b;
    };
    groups.for_each([&](std::span<HalfEdge> group) {
      if (group.size() < 2) return;
      if (group.size() > 2) std::sort(group.begin(), group.end(), by_apex);
      for (std::size_t i = 1; i < group.size(); ++i) {
        if (apex(mesh_, group[i]) == apex(mesh_, group[i - 1])) dead[group[i] / 3] = 1;
      }
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < mesh_.triangles.size(); ++i) {
      if (dead[i] != 0) continue;
      if (by_triangle_ != nullptr) (*by_triangle_)[kept] = (*by_triangle_)[i];
      mesh_.triangles[kept++] = mesh_.triangles[i];
    }
    if (by_triangle_ != nullptr) by_triangle_->resize(kept);
    result_.duplicate_triangles = mesh_.triangles.size() - kept;
    mesh_.triangles.resize(kept);
  }

  // Breadth first over edges of two faces: every region gets one winding, the one most of its faces have. Breadth first
  // keeps the seam short where a region cannot be oriented.
  void grow_regions() {
    const std::size_t count = mesh_.triangles.size();
    region_.assign(count, ~std::uint32_t{0});
    flip_.assign(count, 0);
    std::vector<std::uint32_t> queue;
    queue.reserve(count);
    for (std::size_t seed = 0; seed < count; ++seed) {
      if (region_[seed] != ~std::uint32_t{0}) continue;
      const std::size_t first = queue.size();
      std::size_t flips = 0;
      region_[seed] = region_count_;
      queue.push_back(static_cast<std::uint32_t>(seed));
      for (std::size_t at = first; at < queue.size(); ++at) {
        flips += flip_[queue[at]];
        visit_neighbors(queue[at], queue);
      }
      ++region_count_;
      if (2 * flips <= queue.size() - first) continue;
      for (std::size_t i = first; i < queue.size(); ++i) flip_[queue[i]] ^= 1;
    }
  }

  void visit_neighbors(std::uint32_t triangle, std::vector<std::uint32_t>& queue) {
    for (HalfEdge h = 3 * triangle; h < 3 * triangle + 3; ++h) {
      const HalfEdge o = result_.opposite[h];
      if (o == kNoHalfEdge) continue;
      if (region_[o / 3] == ~std::uint32_t{0}) {
        region_[o / 3] = region_count_;
        if (runs_up(h) == runs_up(o)) flip_[o / 3] = 1;
        queue.push_back(o / 3);
      } else if (runs_up(h) == runs_up(o)) {
        result_.opposite[h] = result_.opposite[o] = kNoHalfEdge;
        result_.has_split_edges = true;
      }
    }
  }

  struct Side {
    HalfEdge half_edge;
    RegionForest::Place place;
    bool up;       // direction along the edge once its region is wound like its root
    double angle;  // of the face around the edge, seen against the upward direction
  };
  struct Candidate {
    double cost;
    std::uint32_t first;
    std::uint32_t second;
  };

  void pair_crowded_edge(std::span<const HalfEdge> group, RegionForest& forest) {
    result_.has_split_edges = true;
    std::vector<Side>& sides = sides_;
    sides.clear();
    for (const HalfEdge h : group) {
      const RegionForest::Place place = forest.find(region_[h / 3]);
      sides.push_back({h, place, runs_up(h) != place.reversed, 0});
    }
    if (group.size() > kMaxFacesPairedByShape) {
      pair_in_order(forest);
    } else {
      measure_angles();
      pair_by_shape(true, forest);
      pair_by_shape(false, forest);
    }
  }

  // The angle of every face around the edge, in a frame common to the group; 0 for faces without area.
  void measure_angles() {
    const HalfEdge reference = sides_.front().half_edge;
    const VertexId low = std::min(origin(mesh_, reference), target(mesh_, reference));
    const VertexId high = std::max(origin(mesh_, reference), target(mesh_, reference));
    const glm::dvec3 base = mesh_.positions[low];
    const glm::dvec3 axis = glm::normalize(mesh_.positions[high] - base);
    glm::dvec3 x = std::abs(axis.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    x = glm::normalize(x - axis * glm::dot(x, axis));
    const glm::dvec3 y = glm::cross(axis, x);
    for (Side& side : sides_) {
      const glm::dvec3 arm = mesh_.positions[apex(mesh_, side.half_edge)] - base;
      side.angle = std::atan2(glm::dot(arm, y), glm::dot(arm, x));
      if (!std::isfinite(side.angle)) side.angle = 0;  // coordinates so small that lengths underflow
    }
  }

  // Flattest first. The inside of a face that runs up lies clockwise of it, so the clockwise angle from it to its
  // partner is the angle of the solid: less than pi where convex, which breaks ties.
  double shape_cost(const Side& a, const Side& b) const {
    double inner = a.up ? a.angle - b.angle : b.angle - a.angle;
    if (inner < 0) inner += 2 * std::numbers::pi;
    return std::abs(inner - std::numbers::pi) + 1e-6 * inner;
  }

  // `agreeing`: only pairs whose windings agree as they are; else pairs that agree once one region is reversed.
  void pair_by_shape(bool agreeing, RegionForest& forest) {
    candidates_.clear();
    for (std::uint32_t i = 0; i < sides_.size(); ++i) {
      for (std::uint32_t j = i + 1; j < sides_.size(); ++j) {
        if (sides_[i].half_edge == kNoHalfEdge || sides_[j].half_edge == kNoHalfEdge) continue;
        if ((sides_[i].up != sides_[j].up) != agreeing) continue;
        candidates_.push_back({shape_cost(sides_[i], sides_[j]), i, j});
      }
    }
    std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
      return std::tie(a.cost, a.first, a.second) < std::tie(b.cost, b.first, b.second);
    });
    for (const Candidate& candidate : candidates_) try_pair(sides_[candidate.first], sides_[candidate.second], forest);
  }

  // First sides that agree, then neighbours in the list among those left over.
  void pair_in_order(RegionForest& forest) {
    std::vector<std::uint32_t> waiting[2];  // by direction
    for (std::uint32_t i = 0; i < sides_.size(); ++i) {
      const std::size_t direction = sides_[i].up ? 1 : 0;
      std::vector<std::uint32_t>& partners = waiting[1 - direction];
      if (!partners.empty() && try_pair(sides_[partners.back()], sides_[i], forest)) {
        partners.pop_back();
      } else {
        waiting[direction].push_back(i);
      }
    }
    for (const std::vector<std::uint32_t>& left : waiting) {
      for (std::size_t i = 1; i < left.size(); ++i) try_pair(sides_[left[i - 1]], sides_[left[i]], forest);
    }
  }

  bool try_pair(Side& a, Side& b, RegionForest& forest) {
    if (a.half_edge == kNoHalfEdge || b.half_edge == kNoHalfEdge) return false;
    const RegionForest::Place place_a = forest.find(region_[a.half_edge / 3]);
    const RegionForest::Place place_b = forest.find(region_[b.half_edge / 3]);
    const bool up_a = runs_up(a.half_edge) != place_a.reversed;
    const bool up_b = runs_up(b.half_edge) != place_b.reversed;
    if (place_a.root == place_b.root) {
      if (up_a == up_b) return false;
    } else {
      forest.join(place_a, place_b, up_a == up_b);
    }
    join(a.half_edge, b.half_edge);
    a.half_edge = b.half_edge = kNoHalfEdge;
    return true;
  }

  // Reverses whole components so that most of their faces are wound as in the input.
  void settle_windings(RegionForest& forest) {
    std::vector<std::int64_t> balance(region_count_, 0);  // per root: faces left as they were, minus faces reversed
    for (std::size_t i = 0; i < flip_.size(); ++i) {
      const RegionForest::Place place = forest.find(region_[i]);
      flip_[i] ^= place.reversed ? 1 : 0;
      balance[place.root] += flip_[i] != 0 ? -1 : 1;
    }
    for (std::size_t i = 0; i < flip_.size(); ++i) {
      if (balance[forest.find(region_[i]).root] < 0) flip_[i] ^= 1;
    }
  }

  // Reversing swaps corners 1 and 2, which turns half-edges 0, 1, 2 into 2, 1, 0.
  void apply_flips() {
    std::vector<HalfEdge>& opposite = result_.opposite;
    for (HalfEdge& o : opposite) {
      if (o != kNoHalfEdge && flipped(o)) o = o - o % 3 + (2 - o % 3);
    }
    for (std::size_t i = 0; i < flip_.size(); ++i) {
      if (flip_[i] == 0) continue;
      std::swap(opposite[3 * i], opposite[3 * i + 2]);
      std::swap(mesh_.triangles[i][1], mesh_.triangles[i][2]);
      ++result_.flipped_triangles;
    }
  }

  TriangleMesh& mesh_;
  std::vector<std::uint32_t>* by_triangle_;
  FacePairing result_;
  std::vector<std::uint32_t> region_;  // per triangle
  std::vector<std::uint8_t> flip_;     // per triangle
  std::uint32_t region_count_ = 0;
  std::vector<Side> sides_;            // of the edge at hand
  std::vector<Candidate> candidates_;  // of the edge at hand
};

}  // namespace

FacePairing pair_faces(TriangleMesh& mesh, std::vector<std::uint32_t>* by_triangle) {
  return Pairer(mesh, by_triangle).run();
}

}  // namespace fanstream
