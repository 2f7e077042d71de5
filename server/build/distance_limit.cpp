#include "server/build/distance_limit.h"

#include <algorithm>

namespace fanstream {

DistanceLimit::DistanceLimit(const TriangleMesh& mesh, double growth)
    : growth_(static_cast<float>(growth)), around_(mesh.positions.size(), mesh.triangles) {
  const Bounds box = bounds_of(mesh.positions);
  middle_ = 0.5 * (box.low + box.high);
  scale_ = box.diagonal() > 0.0 ? 4096.0 / box.diagonal() : 1.0;
  places_.reserve(mesh.positions.size());
  for (const glm::dvec3& p : mesh.positions) places_.push_back(scaled(p));
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    const Triangle& t = mesh.triangles[f];
    faces_.push_back({{t[0], t[1], t[2]}});
    for (const VertexId v : t) {
      if (around_.of(v).front() == f) add_point(mesh.positions[v], f);
    }
  }
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    for (int i = 0; i < 3; ++i) {
      const VertexId from = faces_[f].corners[i];
      const VertexId to = faces_[f].corners[(i + 1) % 3];
      if (from < to || !has_edge(to, from)) add_point(0.5 * (mesh.positions[from] + mesh.positions[to]), f);
    }
  }
}

// Whether a face goes from the one to the other.
bool DistanceLimit::has_edge(VertexId from, VertexId to) const {
  for (const std::uint32_t f : around_.of(from)) {
    const auto& c = faces_[f].corners;
    if ((c[0] == from && c[1] == to) || (c[1] == from && c[2] == to) || (c[2] == from && c[0] == to)) return true;
  }
  return false;
}

void DistanceLimit::add_point(const glm::dvec3& place, std::uint32_t face) {
  points_.push_back({scaled(place), faces_[face].first_point});
  faces_[face].first_point = static_cast<std::uint32_t>(points_.size() - 1);
}

void DistanceLimit::begin_generation(std::uint32_t vertices, bool limited) {
  limit_ = std::numeric_limits<float>::infinity();
  trial_merges_ = static_cast<std::size_t>(kTrialShare * vertices);
  if (limited && !reached_.empty()) set_limit(growth_);
  reached_.clear();
}

// From what was reached.
void DistanceLimit::set_limit(float growth) {
  const auto at = reached_.begin() + static_cast<std::ptrdiff_t>(kShare * static_cast<double>(reached_.size() - 1));
  std::nth_element(reached_.begin(), at, reached_.end());
  limit_ = std::max(growth * growth * *at, kLeast * kLeast);
  trial_merges_ = 0;
}

void DistanceLimit::gather_one(std::uint32_t face, VertexId centre, VertexId other, bool again) {
  const auto& c = faces_[face].corners;
  if (c[0] == other || c[1] == other || c[2] == other) {
    if (!again) vanishing_.push_back(face);
    return;
  }
  const int at = c[0] == centre ? 0 : c[1] == centre ? 1 : 2;
  rest_.push_back({face, c[(at + 1) % 3], c[(at + 2) % 3]});
}

void DistanceLimit::gather(VertexId root, VertexId removed) {
  rest_.clear();
  vanishing_.clear();
  for (const std::uint32_t f : around_.of(root)) gather_one(f, root, removed, false);
  for (const std::uint32_t f : around_.of(removed)) gather_one(f, removed, root, true);
  star_.clear();
  for (const Rest& rest : rest_) star_.add(places_[rest.from] - target_, places_[rest.to] - target_);
  distances_.resize(std::max<std::size_t>(distances_.size(), star_.stored()));
}

// A face's points are mostly nearest to it still, so it is asked first, about four at a time.
bool DistanceLimit::is_within(std::uint32_t face, std::uint32_t rest) {
  std::uint32_t p = faces_[face].first_point;
  while (p != kNone) {
    glm::vec3 at[4];
    int count = 0;
    for (; count < 4 && p != kNone; p = points_[p].next) at[count++] = points_[p].place - target_;
    Float4 own = float4(std::numeric_limits<float>::infinity());
    if (rest != kNone) {
      FourPoints four;
      for (int i = 0; i < 4; ++i) four.set(i, at[std::min(i, count - 1)]);
      own = star_.squared(four, rest);
    }
    for (int i = 0; i < count; ++i) {
      if (!(own[i] <= limit_) && !(star_.nearest(at[i], distances_.data()).squared <= limit_)) return false;
    }
  }
  return true;
}

bool DistanceLimit::allows(VertexId root, VertexId removed, const glm::dvec3& target) {
  target_ = scaled(target);
  gather(root, removed);
  if (rest_.empty() || !is_limited()) return true;
  for (const std::uint32_t f : vanishing_) {
    if (!is_within(f, kNone)) return false;
  }
  for (std::uint32_t i = 0; i < rest_.size(); ++i) {
    if (!is_within(rest_[i].face, i)) return false;
  }
  return true;
}

void DistanceLimit::merge(VertexId root, VertexId removed) {
  moving_.clear();
  const auto take_points = [&](Face& face) {
    for (std::uint32_t p = face.first_point; p != kNone; p = points_[p].next) moving_.push_back(p);
    face.first_point = kNone;
  };
  for (const std::uint32_t f : vanishing_) {
    take_points(faces_[f]);
    for (const VertexId v : faces_[f].corners) around_.remove(v, f);
  }
  const std::span<std::uint32_t> around = around_.replace(root, rest_.size());
  around_.replace(removed, 0);
  places_[root] = target_;
  for (std::size_t i = 0; i < rest_.size(); ++i) {
    Face& face = faces_[rest_[i].face];
    take_points(face);
    face = {{root, rest_[i].from, rest_[i].to}};
    around[i] = rest_[i].face;
  }
  float most = 0.0F;
  for (const std::uint32_t p : moving_) {
    if (rest_.empty()) break;
    const StarDistance::Nearest nearest = star_.nearest(points_[p].place - target_, distances_.data());
    most = std::max(most, nearest.squared);
    Face& face = faces_[rest_[nearest.face].face];
    points_[p].next = face.first_point;
    face.first_point = p;
  }
  reached_.push_back(most);
  if (reached_.size() == trial_merges_) set_limit(kTrialGrowth);
}

}  // namespace fanstream
