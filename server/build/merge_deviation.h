// How far a merge moves the surface.
#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace fanstream {

// Before a merge, two centres inside a common ring: the first owns the ring from position `arc` on to its end and back to
// position 0, the second from 0 to `arc` (both wings included). After it, one centre for all.
struct MergePatch {
  std::span<const glm::dvec3> ring;  // counter-clockwise
  std::size_t gap = static_cast<std::size_t>(-1);  // the ring position of kOutside, if any: it has no place
  std::size_t arc = 0;
  glm::dvec3 first{0.0};
  glm::dvec3 second{0.0};
  glm::dvec3 merged{0.0};
};

// An upper bound of the distance between the two surfaces, both ways. Where both project one to one along the ring's normal it is
// the largest vertical distance, which the overlay of the two triangulations has at one of its corners (Bajaj and
// Schikore 1996; Ciampalini et al. 1997); elsewhere it is how far the centres move. Not thread safe: keeps scratch space.
class MergeDeviation {
 public:
  double bound(const MergePatch& patch);

 private:
  struct Point {  // relative to the merged centre
    double x, y, z;  // z along the normal
  };
  std::size_t next(std::size_t i) const { return i + 1 == ring_.size() ? 0 : i + 1; }
  bool folds(const Point& centre, std::size_t from, std::size_t edges) const;
  double height_above_star(const Point& query) const;
  double highest_crossing(const Point& centre, std::size_t from, std::size_t spokes);
  double highest_between_centres(const Point& first, const Point& second) const;

  std::vector<Point> ring_;
  std::vector<double> sides_;
};

}  // namespace fanstream
