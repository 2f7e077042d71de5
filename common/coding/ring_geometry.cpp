#include "common/coding/ring_geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace fanstream {

void RingGeometry::assign(std::span<const VertexId> ring, VertexId root, std::span<const GridPoint> places,
                          const glm::vec3& unit) {
  size_ = static_cast<std::uint32_t>(ring.size());
  if (ids_.size() < size_) {
    ids_.resize(size_);
    spokes_.resize(size_ + 1);
    squares_.resize(size_);
    reach_sums_.resize(2 * size_ + 1);
    reaches_.resize(size_);
  }
  start_ = canonical_start(ring);
  gap_ = size_;
  const GridPoint& c = places[root];
  const Int4 centre{c.x, c.y, c.z, 0};
  const Float4 units = float4(unit);
  std::uint32_t at = start_;
  for (std::uint32_t i = 0; i < size_; ++i) {
    const VertexId v = ring[at];
    if (++at == size_) at = 0;
    ids_[i] = v;
    if (v == kOutside) {
      gap_ = i;
      spokes_[i] = Float4{};
      continue;
    }
    const GridPoint& p = places[v];
    spokes_[i] = __builtin_convertvector(Int4{p.x, p.y, p.z, 0} - centre, Float4) * units;
  }
  spokes_[size_] = spokes_[0];
  measure();
}

// Sums run in ring order: the order is part of the format, since floating-point sums depend on it.
void RingGeometry::measure() {
  const Float4* spokes = spokes_.data();
  Float4 normal{};
  float lengths = 0.0F;
  for (std::uint32_t i = 0; i < size_; ++i) {
    squares_[i] = dot3(spokes[i], spokes[i]);
    lengths += std::sqrt(squares_[i]);
    normal += cross_rotated(spokes[i], spokes[i + 1]);  // zero beside the gap
  }
  normal = rotate_axes(normal);
  const float length = std::sqrt(dot3(normal, normal));
  normal_ = length > 0.0F ? normal / float4(length) : Float4{0.0F, 0.0F, 1.0F, 0.0F};
  float bend = 0.0F;
  for (std::uint32_t i = 0; i < size_; ++i) bend += std::fabs(dot3(spokes[i], normal_));
  const float count = static_cast<float>(is_open() ? size_ - 1 : size_);
  mean_length_ = lengths / count;
  bend_ = bend / count;
}

// Long spokes inside the arc speak for it, long wings against it: wings are neighbours of both centres.
const float* RingGeometry::reaches(std::uint32_t length) const {
  float* sums = reach_sums_.data();
  sums[0] = 0.0F;
  for (std::uint32_t i = 0; i < size_; ++i) sums[i + 1] = sums[i] + squares_[i];
  for (std::uint32_t i = 1; i <= length + 1 && i <= size_; ++i) sums[size_ + i] = sums[size_] + sums[i];
  float* result = reaches_.data();
  for (std::uint32_t i = 0; i < size_; ++i) {
    const float inside = sums[i + length] - sums[i + 1];
    const float with_wings = sums[i + length + 1] - sums[i];
    result[i] = 1.4F * inside - 0.4F * with_wings;
  }
  return result;
}

std::uint32_t RingGeometry::rank_of_first(std::uint32_t length, std::uint32_t first) const {
  const float* reach = reaches(length);
  std::uint32_t rank = 0;
  for (std::uint32_t i = 0; i < size_; ++i) {
    rank += static_cast<std::uint32_t>(reach[i] > reach[first] || (reach[i] == reach[first] && i < first));
  }
  return rank;
}

std::uint32_t RingGeometry::first_of_rank(std::uint32_t length, std::uint32_t rank) const {
  reaches(length);
  constexpr std::uint32_t kFewRounds = 64;
  if (rank > kFewRounds) {  // only hubs of very long rings come here
    std::vector<std::uint32_t> order(size_);
    std::iota(order.begin(), order.end(), 0U);
    std::stable_sort(order.begin(), order.end(), [this](std::uint32_t a, std::uint32_t b) { return reaches_[a] > reaches_[b]; });
    return order[rank];
  }
  for (std::uint32_t round = 0;; ++round) {
    std::uint32_t best = 0;
    for (std::uint32_t i = 1; i < size_; ++i) {
      if (reaches_[i] > reaches_[best]) best = i;
    }
    if (round == rank) return best;
    reaches_[best] = -std::numeric_limits<float>::infinity();
  }
}

}  // namespace fanstream
