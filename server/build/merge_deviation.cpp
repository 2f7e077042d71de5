#include "server/build/merge_deviation.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace fanstream {
namespace {

template <class P>
double turn(const P& a, const P& b, const P& c) {  // twice the signed area in the plane
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

template <class P>
double turn_around_origin(const P& b, const P& c) {
  return b.x * c.y - b.y * c.x;
}

}  // namespace

double MergeDeviation::bound(const MergePatch& patch) {
  const double moved =
      std::max(glm::length(patch.first - patch.merged), glm::length(patch.second - patch.merged));
  const std::size_t size = patch.ring.size();
  // A boundary moves in its own plane, which the overlay does not see.
  if (patch.gap < size) return moved;
  glm::dvec3 normal(0.0);
  for (std::size_t i = 0; i < size; ++i) {
    normal += glm::cross(patch.ring[i] - patch.merged, patch.ring[i + 1 == size ? 0 : i + 1] - patch.merged);
  }
  const double length = glm::length(normal);
  if (!(length > 0.0)) return moved;
  normal /= length;
  const glm::dvec3 other = std::fabs(normal.x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 u = glm::normalize(glm::cross(normal, other));
  const glm::dvec3 v = glm::cross(normal, u);
  const auto project = [&](const glm::dvec3& p) {
    const glm::dvec3 d = p - patch.merged;
    return Point{glm::dot(d, u), glm::dot(d, v), glm::dot(d, normal)};
  };
  ring_.resize(size);
  for (std::size_t i = 0; i < size; ++i) ring_[i] = project(patch.ring[i]);
  const Point first = project(patch.first);
  const Point second = project(patch.second);
  const std::size_t rest = size - patch.arc;
  // The two faces that vanish hang on the wings: {first, second, wing}.
  const bool middle_folds = turn(ring_[0], second, first) <= 0.0 || turn(ring_[patch.arc], first, second) <= 0.0;
  if (middle_folds || folds({0.0, 0.0, 0.0}, 0, size)) return moved;
  // A centre that stays where it is has its faces in both surfaces.
  double highest = 0.0;
  if (patch.merged != patch.second) {
    if (folds(second, 0, patch.arc)) return moved;
    highest = std::max(height_above_star(second), highest_crossing(second, 0, patch.arc + 1));
  }
  if (patch.merged != patch.first) {
    if (folds(first, patch.arc, rest)) return moved;
    highest = std::max({highest, height_above_star(first), highest_crossing(first, patch.arc, rest + 1)});
  }
  // The edge between the two centres, and the new centre under the old faces, are corners of the overlay too; where the new centre
  // is one of the old ones both have been looked at.
  if (patch.merged != patch.first && patch.merged != patch.second) {
    highest = std::max(highest, highest_between_centres(first, second));
  }
  return std::min(highest, moved);
}

bool MergeDeviation::folds(const Point& centre, std::size_t from, std::size_t edges) const {
  for (std::size_t i = 0, a = from; i < edges; ++i, a = next(a)) {
    if (turn(centre, ring_[a], ring_[next(a)]) <= 0.0) return true;
  }
  return false;
}

// The vertical distance between a point and the star around the merged centre; points in no face of it count as in the nearest.
double MergeDeviation::height_above_star(const Point& query) const {
  double best_outside = -1e300;
  double height = 0.0;
  for (std::size_t i = 0; i < ring_.size(); ++i) {
    const Point& a = ring_[i];
    const Point& b = ring_[next(i)];
    const double area = turn_around_origin(a, b);
    const double wa = turn_around_origin(query, b) / area;
    const double wb = turn_around_origin(a, query) / area;
    const double inside = std::min({wa, wb, 1.0 - wa - wb});
    if (inside <= best_outside) continue;
    best_outside = inside;
    height = std::fabs(query.z - (wa * a.z + wb * b.z));
    if (inside >= 0.0) break;
  }
  return height;
}

// The largest vertical distance where the edges from `centre` to `spokes` ring places cross the merged centre's edges.
double MergeDeviation::highest_crossing(const Point& centre, std::size_t from, std::size_t spokes) {
  double highest = 0.0;
  sides_.resize(ring_.size());
  for (std::size_t j = 0; j < ring_.size(); ++j) sides_[j] = turn_around_origin(ring_[j], centre);
  for (std::size_t i = 0, at = from; i < spokes; ++i, at = next(at)) {
    const Point& end = ring_[at];
    for (std::size_t j = 0; j < ring_.size(); ++j) {
      const Point& w = ring_[j];
      const double from_side = sides_[j];
      const double to_side = turn_around_origin(w, end);
      if ((from_side > 0.0) == (to_side > 0.0) || j == at) continue;
      const double s = from_side / (from_side - to_side);
      const double x = centre.x + s * (end.x - centre.x);
      const double y = centre.y + s * (end.y - centre.y);
      const double t = (x * w.x + y * w.y) / (w.x * w.x + w.y * w.y);
      if (!(t >= 0.0 && t <= 1.0)) continue;
      const double here = centre.z + s * (end.z - centre.z);
      highest = std::max(highest, std::fabs(here - t * w.z));
    }
  }
  return highest;
}

double MergeDeviation::highest_between_centres(const Point& first, const Point& second) const {
  double highest = std::fabs(first.z + 0.5 * (second.z - first.z));
  for (const Point& w : ring_) {
    const double a = turn_around_origin(w, first);
    const double b = turn_around_origin(w, second);
    if ((a > 0.0) == (b > 0.0)) continue;
    const double s = a / (a - b);
    const Point cross{first.x + s * (second.x - first.x), first.y + s * (second.y - first.y),
                      first.z + s * (second.z - first.z)};
    highest = std::max(highest, height_above_star(cross));
  }
  return highest;
}

}  // namespace fanstream
