#include "server/build/precision_choice.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/geometry/spread_points.h"
#include "common/geometry/triangle_tree.h"

namespace fanstream {
namespace {

// The levels of a history, fine to coarse.
class CoarseningReplay {
 public:
  CoarseningReplay(const TriangleMesh& mesh, const MergeHistory& history)
      : mesh_(mesh), history_(history), places_(mesh.positions), root_of_(mesh.positions.size()) {
    for (VertexId v = 0; v < root_of_.size(); ++v) root_of_[v] = v;
  }

  std::uint32_t vertices() const { return static_cast<std::uint32_t>(places_.size()) - next_; }

  // All merges before this one.
  void coarsen_to(std::uint32_t merge) {
    for (; next_ < merge; ++next_) {
      const MergeRecord& m = history_.merges[next_];
      if (m.parent == ParentPosition::added) places_[m.root] = places_[m.removed];
      if (m.parent == ParentPosition::middle) places_[m.root] = 0.5 * (places_[m.root] + places_[m.removed]);
      if (m.parent == ParentPosition::free) places_[m.root] = history_.free_places[next_];
      root_of_[m.removed] = m.root;
    }
  }

  // LevelDistance::known_since of the level as it is now, its faces being `level`'s.
  std::vector<double> known_since(const TriangleMesh& level) const {
    std::vector<double> area(places_.size(), 0.0);  // three times that of a vertex
    double all = 0.0;
    for (const Triangle& t : level.triangles) {
      const double of_face = area_of(level, t);
      for (const VertexId v : t) area[v] += of_face;
      all += 3.0 * of_face;
    }
    std::vector<double> shares(1, 0.0);
    std::vector<std::uint32_t> touched(places_.size(), 0);  // generations from the coarsest on
    for (std::uint32_t g = history_.generation_count(); g-- > 0 && history_.generation_begin[g] >= next_;) {
      for (std::uint32_t m = history_.generation_begin[g]; m < history_.generation_begin[g + 1]; ++m) {
        touched[history_.merges[m].root] = touched[history_.merges[m].removed] = history_.generation_count() - g;
      }
      shares.push_back(0.0);
    }
    std::vector<std::uint32_t> next(places_.size(), kNeverSplit);
    for (std::uint32_t g = 0; g < history_.generation_count() && history_.generation_begin[g] < next_; ++g) {
      for (std::uint32_t m = history_.generation_begin[g]; m < history_.generation_begin[g + 1]; ++m) {
        next[history_.merges[m].root] = history_.generation_count() - g;
      }
    }
    for (VertexId v = 0; v < area.size(); ++v) {
      if (next[v] == kNeverSplit || !(all > 0.0)) continue;
      const std::size_t known = PlacePrecision::known_in(touched[v], next[v]);
      if (known < shares.size()) shares[known] += area[v] / all;  // else it is as exact as finer levels ask for
    }
    std::partial_sum(shares.begin(), shares.end(), shares.begin());
    return shares;
  }

  TriangleMesh level() {
    TriangleMesh level;
    level.positions = places_;
    for (const Triangle& t : mesh_.triangles) {
      const Triangle now{root(t[0]), root(t[1]), root(t[2])};
      if (now[0] != now[1] && now[1] != now[2] && now[2] != now[0]) level.triangles.push_back(now);
    }
    return level;
  }

 private:
  VertexId root(VertexId v) {
    while (root_of_[v] != v) v = root_of_[v] = root_of_[root_of_[v]];
    return v;
  }

  const TriangleMesh& mesh_;
  const MergeHistory& history_;
  std::vector<glm::dvec3> places_;
  std::vector<VertexId> root_of_;
  std::uint32_t next_ = 0;
};

// Where more of the vertices are told exactly anyway, leaving bits out of the rest costs a decoder more than it saves.
constexpr double kMostFinal = 0.4;

double sampled_distance(const std::vector<SpreadPoint>& points, const TriangleMesh& level) {
  const Result<TriangleTree> tree = TriangleTree::build(level);
  if (!tree) return 0.0;
  double sum = 0.0;
  std::uint32_t hint = 0;
  for (const SpreadPoint& p : points) {
    const SurfacePoint nearest = tree->closest(p.place, hint);
    hint = nearest.slot;
    sum += nearest.squared_distance;
  }
  return std::sqrt(sum / static_cast<double>(points.size()));
}

// Between two levels straight in logarithms; before the first and behind the last in inverse proportion to the
// vertices.
double distance_at(const std::vector<LevelDistance>& levels, double vertices) {
  const auto below = std::find_if(levels.begin(), levels.end(), [&](const auto& l) { return l.vertices <= vertices; });
  if (below == levels.begin()) return below->rms * below->vertices / vertices;
  if (below == levels.end()) return levels.back().rms * levels.back().vertices / vertices;
  const LevelDistance& fine = below[-1];
  if (!(fine.rms > 0.0) || !(below->rms > 0.0)) return 0.0;
  const double share =
      std::log(vertices / below->vertices) / std::log(static_cast<double>(fine.vertices) / below->vertices);
  return below->rms * std::pow(fine.rms / below->rms, share);
}

// For each generation from the coarsest on, how many of the vertices that its splits leave are never split again.
std::vector<double> final_shares(std::size_t vertex_count, const MergeHistory& history) {
  std::vector<bool> is_split(vertex_count, false);  // in a finer generation
  std::vector<double> shares;
  for (std::uint32_t finest = 0; finest < history.generation_count(); ++finest) {
    const std::uint32_t begin = history.generation_begin[finest];
    const std::uint32_t end = history.generation_begin[finest + 1];
    double final = 0.0;
    for (std::uint32_t m = begin; m < end; ++m) {
      const MergeRecord& merge = history.merges[m];
      final += (is_split[merge.root] ? 0.0 : 1.0) + (is_split[merge.removed] ? 0.0 : 1.0);
      is_split[merge.root] = true;
    }
    shares.push_back(end > begin ? final / (2.0 * (end - begin)) : 0.0);
  }
  return {shares.rbegin(), shares.rend()};
}

// Mean square distance of a cell's codes from the one that stands for them, in steps of the grid.
double cell_noise(std::uint32_t bits) { return (std::exp2(2.0 * bits) - 1.0) / 12.0 + 0.25; }

// Of places on the grid itself, likewise.
constexpr double kRoundingNoise = 1.0 / 12.0;

}  // namespace

std::vector<LevelDistance> measure_level_distances(const TriangleMesh& mesh, const MergeHistory& history) {
  std::vector<LevelDistance> levels;
  CoarseningReplay replay(mesh, history);
  const std::vector<SpreadPoint> points = spread_points(mesh, 4000);
  std::uint32_t most = std::min<std::uint32_t>(static_cast<std::uint32_t>(mesh.positions.size()) / 2, 50'000);
  for (const std::uint32_t end : history.generation_begin) {
    replay.coarsen_to(end);
    if (replay.vertices() > most && end != history.merges.size()) continue;
    const TriangleMesh level = replay.level();
    levels.push_back({replay.vertices(), sampled_distance(points, level), replay.known_since(level)});
    most = replay.vertices() / 2;
  }
  return levels;
}

PlacePrecision choose_precision(const TriangleMesh& mesh, const MergeHistory& history, const PositionGrid& grid,
                                double noise) {
  const std::uint32_t most = PlacePrecision::most_left_out(grid);
  if (most == 0 || history.generation_count() == 0 || !(noise > 0.0)) return PlacePrecision({}, grid);
  const std::vector<LevelDistance> levels = measure_level_distances(mesh, history);
  const std::vector<double> final_share = final_shares(mesh.positions.size(), history);
  std::vector<std::uint8_t> left_out;
  std::uint32_t left = most;
  for (std::uint32_t g = 0; g < history.generation_count(); ++g) {
    const std::uint32_t merged = history.generation_begin[history.generation_count() - g];
    const double off = distance_at(levels, static_cast<double>(mesh.positions.size()) - merged) / grid.step();
    while (left > 0 && cell_noise(left) > noise * off * off) --left;
    for (const LevelDistance& level : levels) {
      const double level_off = level.rms / grid.step();
      while (left > 0 && g < level.known_since.size() &&
             cell_noise(left) * level.known_since[g] > noise * (level_off * level_off + kRoundingNoise)) {
        --left;
      }
    }
    if (g > 0 && final_share[g - 1] > kMostFinal) left = 0;
    left_out.push_back(static_cast<std::uint8_t>(left));
  }
  return PlacePrecision(left_out, grid);
}

}  // namespace fanstream
