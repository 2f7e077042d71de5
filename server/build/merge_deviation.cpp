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

}  // namespace

double MergeDeviation::bound(const MergePatch& patch) {
  const double moved =
      std::max(glm::length(patch.first - patch.merged), glm::length(patch.second - patch.merged));
  const std::size_t size = patch.ring.size();
  gap_ = patch.gap;
  glm::dvec3 normal(0.0);
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t next = (i + 1) % size;
    if (i == gap_ || next == gap_) continue;
    normal += glm::cross(patch.ring[i] - patch.merged, patch.ring[next] - patch.merged);
  }
  const double length = glm::length(normal);
  // A boundary moves in its own plane, which the overlay does not see.
  if (!(length > 0.0) || gap_ < size) return moved;
  normal /= length;
  const glm::dvec3 other = std::fabs(normal.x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 u = glm::normalize(glm::cross(normal, other));
  const glm::dvec3 v = glm::cross(normal, u);
  const auto project = [&](const glm::dvec3& p) {
    const glm::dvec3 d = p - patch.merged;
    return Point{glm::dot(d, u), glm::dot(d, v), glm::dot(d, normal)};
  };
  ring_.clear();
  for (const glm::dvec3& p : patch.ring) ring_.push_back(project(p));
  const Point first = project(patch.first);
  const Point second = project(patch.second);
  const Point merged = project(patch.merged);
  const std::size_t rest = size - patch.arc;
  // The two faces that vanish hang on the wings: {first, second, wing}.
  const bool middle_folds = turn(ring_[0], second, first) <= 0.0 || turn(ring_[patch.arc], first, second) <= 0.0;
  if (middle_folds || folds(merged, 0, size) || folds(second, 0, patch.arc) || folds(first, patch.arc, rest)) return moved;
  double highest = std::max(height_above_star(first, merged), height_above_star(second, merged));
  highest = std::max(highest, highest_crossing(second, 0, patch.arc + 1, merged));
  highest = std::max(highest, highest_crossing(first, patch.arc, rest + 1, merged));
  // The edge between the two centres, and the new centre under the old faces, are corners of the overlay too; where the new centre
  // is one of the old ones both have been looked at.
  if (patch.merged != patch.first && patch.merged != patch.second) {
    const double t = 0.5;
    highest = std::max(highest, std::fabs(first.z + t * (second.z - first.z) - merged.z));
    for (const Point& w : ring_) {
      const double a = turn(merged, w, first);
      const double b = turn(merged, w, second);
      if ((a > 0.0) == (b > 0.0)) continue;
      const double s = a / (a - b);
      const Point cross{first.x + s * (second.x - first.x), first.y + s * (second.y - first.y), first.z + s * (second.z - first.z)};
      highest = std::max(highest, height_above_star(cross, merged));
    }
  }
  return std::min(highest, moved);
}

bool MergeDeviation::folds(const Point& centre, std::size_t from, std::size_t edges) const {
  for (std::size_t i = 0; i < edges; ++i) {
    const std::size_t a = (from + i) % ring_.size();
    if (is_face(a) && turn(centre, ring_[a], ring_[(a + 1) % ring_.size()]) <= 0.0) return true;
  }
  return false;
}

// The vertical distance between a point and the star around star_centre; points in no face of it count as in the nearest.
double MergeDeviation::height_above_star(const Point& query, const Point& star_centre) const {
  double best_outside = -1e300;
  double height = 0.0;
  for (std::size_t i = 0; i < ring_.size(); ++i) {
    if (!is_face(i)) continue;
    const Point& a = ring_[i];
    const Point& b = ring_[(i + 1) % ring_.size()];
    const double area = turn(star_centre, a, b);
    const double wa = turn(query, b, star_centre) / area;
    const double wb = turn(query, star_centre, a) / area;
    const double inside = std::min({wa, wb, 1.0 - wa - wb});
    if (inside <= best_outside) continue;
    best_outside = inside;
    height = std::fabs(query.z - (star_centre.z + wa * (a.z - star_centre.z) + wb * (b.z - star_centre.z)));
    if (inside >= 0.0) break;
  }
  return height;
}

// The largest vertical distance where the edges from `centre` to `spokes` ring places cross the edges from star_centre.
double MergeDeviation::highest_crossing(const Point& centre, std::size_t from, std::size_t spokes,
                                        const Point& star_centre) const {
  double highest = 0.0;
  for (std::size_t i = 0; i < spokes; ++i) {
    const std::size_t at = (from + i) % ring_.size();
    const Point& end = ring_[at];
    for (std::size_t j = 0; j < ring_.size(); ++j) {
      if (j == at || j == gap_ || at == gap_) continue;
      const Point& w = ring_[j];
      const double from_side = turn(star_centre, w, centre);
      const double to_side = turn(star_centre, w, end);
      if ((from_side > 0.0) == (to_side > 0.0)) continue;
      const double s = from_side / (from_side - to_side);
      const double x = centre.x + s * (end.x - centre.x);
      const double y = centre.y + s * (end.y - centre.y);
      const double dx = w.x - star_centre.x;
      const double dy = w.y - star_centre.y;
      const double t = ((x - star_centre.x) * dx + (y - star_centre.y) * dy) / (dx * dx + dy * dy);
      if (!(t >= 0.0 && t <= 1.0)) continue;
      const double here = centre.z + s * (end.z - centre.z);
      highest = std::max(highest, std::fabs(here - (star_centre.z + t * (w.z - star_centre.z))));
    }
  }
  return highest;
}

}  // namespace fanstream
