#include "server/build/vertex_curvature.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace fanstream {
namespace {

double finite(double value) { return std::isfinite(value) ? value : 0.0; }

// atan2(sine, cosine) where both are of one angle; most edges hardly bend.
double angle_of(double sine, double cosine) {
  if (cosine < 0.92) return std::atan2(sine, cosine);
  const double s2 = sine * sine;
  return sine * (1.0 + s2 * (1.0 / 6.0 + s2 * (3.0 / 40.0 + s2 * (15.0 / 336.0))));
}

// What the faces around each vertex add up to.
class Sums {
 public:
  Sums(const TriangleMesh& mesh, const RingMesh& rings, Curvature which)
      : mesh_(mesh), rings_(rings), areas_(mesh.positions.size(), 0.0) {
    const bool bends = which != Curvature::gaussian;
    if (bends) bends_.assign(areas_.size(), 0.0);
    if (which != Curvature::mean) angles_.assign(areas_.size(), 0.0);
    for (const Triangle& t : mesh.triangles) add_face(t);
    if (!bends) return;
    for (VertexId v = 0; v < areas_.size(); ++v) add_edges(v);
  }

  double mean(VertexId v) const { return areas_[v] > 0.0 ? finite(0.5 * bends_[v] / (areas_[v] / 3.0)) : 0.0; }
  double gaussian(VertexId v) const {
    if (!(areas_[v] > 0.0)) return 0.0;
    const double whole = (rings_.is_boundary(v) ? 1.0 : 2.0) * std::numbers::pi;
    return finite((whole - angles_[v]) / (areas_[v] / 3.0));
  }
  double of(VertexId v, Curvature which) const {
    if (which == Curvature::mean) return mean(v);
    const double k = gaussian(v);
    if (which == Curvature::gaussian) return k;
    const double h = mean(v);
    return finite(k >= 0.0 ? 2.0 * std::fabs(h) : 2.0 * std::sqrt(h * h - k));
  }

 private:
  void add_face(const Triangle& t) {
    const auto at = [&](std::size_t i) -> const glm::dvec3& { return mesh_.positions[t[i]]; };
    const double area = area_of(mesh_, t);
    for (std::size_t i = 0; i < 3; ++i) {
      areas_[t[i]] += area;
      if (angles_.empty()) continue;
      const glm::dvec3 a = at((i + 1) % 3) - at(i);
      const glm::dvec3 b = at((i + 2) % 3) - at(i);
      angles_[t[i]] += std::atan2(2.0 * area, glm::dot(a, b));  // 0 where a side has no length
    }
  }

  // The inner edges from v to larger numbers.
  void add_edges(VertexId v) {
    const auto ring = rings_.ring(v);
    const glm::dvec3& p = mesh_.positions[v];
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const VertexId w = ring[i];
      const VertexId before = ring[i == 0 ? ring.size() - 1 : i - 1];
      const VertexId after = ring[i + 1 == ring.size() ? 0 : i + 1];
      if (w == kOutside || w < v || before == kOutside || after == kOutside) continue;
      const glm::dvec3 edge = mesh_.positions[w] - p;
      const glm::dvec3 n0 = glm::cross(mesh_.positions[before] - p, edge);
      const glm::dvec3 n1 = glm::cross(edge, mesh_.positions[after] - p);
      const double lengths2 = glm::dot(n0, n0) * glm::dot(n1, n1);
      if (!(lengths2 > 0.0)) continue;
      // The normals turn about the edge: clockwise where it is convex, `before` being the face to the right.
      const double length = glm::length(edge);
      const double scale = 1.0 / std::sqrt(lengths2);
      const double bend =
          length * angle_of(glm::dot(glm::cross(n0, n1), edge) * scale / length, glm::dot(n0, n1) * scale);
      bends_[v] += bend;
      bends_[w] += bend;
    }
  }

  const TriangleMesh& mesh_;
  const RingMesh& rings_;
  std::vector<double> areas_;
  std::vector<double> bends_;   // lengths times angles
  std::vector<double> angles_;  // of the faces at the vertex
};

}  // namespace

std::vector<double> vertex_curvature(const TriangleMesh& mesh, const RingMesh& rings, Curvature which) {
  const Sums sums(mesh, rings, which);
  std::vector<double> curvature(mesh.positions.size());
  for (VertexId v = 0; v < curvature.size(); ++v) curvature[v] = sums.of(v, which);
  return curvature;
}

}  // namespace fanstream
