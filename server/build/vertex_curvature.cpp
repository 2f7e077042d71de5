#include "server/build/vertex_curvature.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace fanstream {
namespace {

// Of one vertex's faces, in the order of its ring.
class RingCurvature {
 public:
  void assign(std::span<const VertexId> ring, const glm::dvec3& centre, const std::vector<glm::dvec3>& places) {
    spokes_.resize(ring.size());
    normals_.resize(ring.size());
    is_closed_ = true;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const bool outside = ring[i] == kOutside;
      spokes_[i] = outside ? glm::dvec3(0.0) : places[ring[i]] - centre;
      is_closed_ = is_closed_ && !outside;
    }
    area_ = 0.0;
    for (std::size_t i = 0; i < ring.size(); ++i) {  // the face between spokes i and i + 1; at kOutside without area
      const glm::dvec3 normal = glm::cross(spokes_[i], spokes_[next(i)]);
      const double length = glm::length(normal);
      normals_[i] = length > 0.0 ? normal / length : glm::dvec3(0.0);
      area_ += 0.5 * length;
    }
  }

  double mean() const {
    if (!(area_ > 0.0)) return 0.0;
    double sum = 0.0;
    for (std::size_t i = 0; i < spokes_.size(); ++i) {
      const glm::dvec3& before = normals_[i];
      const glm::dvec3& after = normals_[next(i)];
      if (glm::dot(before, before) == 0.0 || glm::dot(after, after) == 0.0) continue;
      const glm::dvec3& edge = spokes_[next(i)];
      const double length = glm::length(edge);
      // Counter-clockwise around the centre: the normals turn about the edge, outwards where it is convex.
      const double sine = glm::dot(glm::cross(before, after), edge) / length;
      sum += length * std::atan2(sine, glm::dot(before, after));
    }
    return finite(0.5 * sum / (area_ / 3.0));
  }

  double gaussian() const {
    if (!(area_ > 0.0)) return 0.0;
    double angles = 0.0;
    for (std::size_t i = 0; i < spokes_.size(); ++i) {
      const glm::dvec3& a = spokes_[i];
      const glm::dvec3& b = spokes_[next(i)];
      angles += std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));  // 0 where a spoke has no length
    }
    return finite(((is_closed_ ? 2.0 : 1.0) * std::numbers::pi - angles) / (area_ / 3.0));
  }

  double of(Curvature which) const {
    if (which == Curvature::mean) return mean();
    const double k = gaussian();
    if (which == Curvature::gaussian) return k;
    const double h = mean();
    return finite(k >= 0.0 ? 2.0 * std::fabs(h) : 2.0 * std::sqrt(h * h - k));
  }

 private:
  std::size_t next(std::size_t i) const { return i + 1 == spokes_.size() ? 0 : i + 1; }
  static double finite(double value) { return std::isfinite(value) ? value : 0.0; }

  std::vector<glm::dvec3> spokes_;
  std::vector<glm::dvec3> normals_;
  double area_ = 0.0;
  bool is_closed_ = true;
};

}  // namespace

std::vector<double> vertex_curvature(const RingMesh& rings, const std::vector<glm::dvec3>& places, Curvature which) {
  std::vector<double> curvature(places.size(), 0.0);
  RingCurvature ring;
  for (VertexId v = 0; v < curvature.size(); ++v) {
    if (!rings.contains(v)) continue;
    ring.assign(rings.ring(v), places[v], places);
    curvature[v] = ring.of(which);
  }
  return curvature;
}

}  // namespace fanstream
