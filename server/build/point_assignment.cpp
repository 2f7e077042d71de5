#include "server/build/point_assignment.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "common/geometry/closest_point.h"

namespace fanstream {
namespace {

// Steele, Lea, Flood 2014 (SplitMix64); the standard library's distributions differ from machine to machine.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double next() {  // in [0, 1)
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15U;
    z = (z ^ z >> 30U) * 0xBF58476D1CE4E5B9U;
    z = (z ^ z >> 27U) * 0x94D049BB133111EBU;
    return static_cast<double>((z ^ z >> 31U) >> 11U) * 0x1p-53;
  }

 private:
  std::uint64_t state_;
};

}  // namespace

PointAssignment::PointAssignment(const TriangleMesh& mesh, std::uint32_t samples, std::uint64_t seed)
    : around_(mesh.positions.size()) {
  faces_.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    const auto face = static_cast<std::uint32_t>(faces_.size());
    faces_.push_back({t, kNone});
    for (const VertexId v : t) around_[v].push_back(face);
  }
  points_.reserve(mesh.positions.size() + samples);
  for (VertexId v = 0; v < mesh.positions.size(); ++v) {
    if (!around_[v].empty()) add_point(mesh.positions[v], around_[v].front());
  }
  add_samples(mesh, samples, seed);
}

void PointAssignment::add_point(const glm::dvec3& place, std::uint32_t face) {
  points_.push_back({place, 0.0, face, faces_[face].first_point});
  faces_[face].first_point = static_cast<std::uint32_t>(points_.size() - 1);
}

void PointAssignment::add_samples(const TriangleMesh& mesh, std::uint32_t samples, std::uint64_t seed) {
  if (samples == 0) return;
  std::vector<double> area_to;  // of all triangles up to each
  double total = 0.0;
  for (const Triangle& t : mesh.triangles) {
    const glm::dvec3& p = mesh.positions[t[0]];
    total += glm::length(glm::cross(mesh.positions[t[1]] - p, mesh.positions[t[2]] - p));
    area_to.push_back(total);
  }
  if (!(total > 0.0) || !std::isfinite(total)) return;
  Random random(seed);
  for (std::uint32_t i = 0; i < samples; ++i) {
    const auto found = std::upper_bound(area_to.begin(), area_to.end(), total * random.next());
    const auto face = static_cast<std::uint32_t>(std::min(found, area_to.end() - 1) - area_to.begin());
    const Triangle& t = mesh.triangles[face];
    const double s = std::sqrt(random.next());  // Turk, Graphics Gems, 1990
    const double r = random.next();
    add_point((1.0 - s) * mesh.positions[t[0]] + s * (1.0 - r) * mesh.positions[t[1]] + s * r * mesh.positions[t[2]],
              face);
  }
}

void PointAssignment::gather(VertexId root, VertexId removed, Surroundings& around) const {
  around.rest.clear();
  around.points.clear();
  around.squares = 0.0;
  const auto add = [&](std::uint32_t f, VertexId centre, VertexId other, bool again) {
    const Triangle& c = faces_[f].corners;
    const bool vanishes = c[0] == other || c[1] == other || c[2] == other;
    if (vanishes && again) return;
    for (std::uint32_t p = faces_[f].first_point; p != kNone; p = points_[p].next) {
      around.points.push_back(p);
      around.squares += points_[p].squared;
    }
    if (vanishes) return;
    const std::size_t at = c[0] == centre ? 0 : c[1] == centre ? 1 : 2;
    around.rest.push_back({f, c[(at + 1) % 3], c[(at + 2) % 3]});
  };
  for (const std::uint32_t f : around_[root]) add(f, root, removed, false);
  for (const std::uint32_t f : around_[removed]) add(f, removed, root, true);
}

void PointAssignment::merge(VertexId root, VertexId removed, const std::vector<glm::dvec3>& places) {
  gather(root, removed, merging_);
  const auto holds = [&](std::uint32_t f, VertexId v) {
    const Triangle& c = faces_[f].corners;
    return c[0] == v || c[1] == v || c[2] == v;
  };
  for (const std::uint32_t f : around_[removed]) {  // those that vanish, out of the lists of their wings
    if (!holds(f, root)) continue;
    for (const VertexId v : faces_[f].corners) {
      if (v != root && v != removed) std::erase(around_[v], f);
    }
  }
  around_[removed] = {};
  around_[root].clear();
  for (const Surroundings::Rest& rest : merging_.rest) {
    faces_[rest.face] = {{root, rest.from, rest.to}, kNone};
    around_[root].push_back(rest.face);
  }
  star_.assign(merging_.rest, places[root], places);
  if (star_.is_empty()) return;
  for (const std::uint32_t p : merging_.points) {
    Point& point = points_[p];
    const Star::Nearest nearest = star_.nearest(point.place);
    Face& face = faces_[merging_.rest[nearest.index].face];
    point = {point.place, nearest.squared, merging_.rest[nearest.index].face, face.first_point};
    face.first_point = p;
  }
}

void PointAssignment::Star::assign(const std::vector<Surroundings::Rest>& rest, const glm::dvec3& centre,
                                   const std::vector<glm::dvec3>& places) {
  centre_ = centre;
  faces_.resize(rest.size());
  for (std::size_t i = 0; i < rest.size(); ++i) {
    Face& face = faces_[i];
    face.from = places[rest[i].from];
    face.to = places[rest[i].to];
    face.normal = glm::cross(face.from - centre, face.to - centre);
    face.normal2 = glm::dot(face.normal, face.normal);
  }
}

PointAssignment::Star::Nearest PointAssignment::Star::nearest(const glm::dvec3& x) const {
  Nearest best{std::numeric_limits<double>::infinity(), 0, faces_.front().from};
  for (std::uint32_t i = 0; i < faces_.size(); ++i) {
    const Face& face = faces_[i];
    const double height = glm::dot(face.normal, x - centre_);
    if (height * height > best.squared * face.normal2) continue;  // its plane is farther off already
    const glm::dvec3 place = nearest_on(face, x);
    const double squared = glm::dot(place - x, place - x);
    if (squared < best.squared) best = {squared, i, place};
  }
  return best;
}

// Below the middle of a face that is not too thin, the foot of the perpendicular; which is most often so.
glm::dvec3 PointAssignment::Star::nearest_on(const Face& face, const glm::dvec3& x) const {
  const glm::dvec3 from = face.from - centre_;
  const glm::dvec3 to = face.to - centre_;
  const glm::dvec3 at = x - centre_;
  const double share_from = glm::dot(glm::cross(at, to), face.normal);
  const double share_to = glm::dot(glm::cross(from, at), face.normal);
  const double least = 1e-6 * face.normal2;
  if (share_from > least && share_to > least && face.normal2 - share_from - share_to > least) {
    return centre_ + (from * share_from + to * share_to) / face.normal2;
  }
  return closest_point_on_triangle(x, centre_, face.from, face.to);
}

double PointAssignment::Star::share_of_centre(const Nearest& at) const {
  const Face& face = faces_[at.index];
  if (!(face.normal2 > 0.0)) return 0.0;
  const double share = glm::dot(glm::cross(face.from - at.place, face.to - at.place), face.normal) / face.normal2;
  return std::clamp(share, 0.0, 1.0);
}

}  // namespace fanstream
