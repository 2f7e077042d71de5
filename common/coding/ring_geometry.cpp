#include "common/coding/ring_geometry.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace fanstream {

void RingGeometry::assign(std::span<const VertexId> ring, VertexId root, std::span<const GridPoint> places,
                          const glm::vec3& unit) {
  const auto size = static_cast<std::uint32_t>(ring.size());
  ids_.resize(size);
  spokes_.resize(size);
  gap_ = size;
  std::uint32_t at = canonical_start(ring);
  const GridPoint centre = places[root];
  for (std::uint32_t i = 0; i < size; ++i) {
    const VertexId v = ring[at];
    if (++at == size) at = 0;
    ids_[i] = v;
    if (v == kOutside) {
      gap_ = i;
      spokes_[i] = glm::vec3(0.0F);
    } else {
      spokes_[i] = glm::vec3(places[v] - centre) * unit;
    }
  }
  reach_sums_.resize(2 * size + 1);
  reach_sums_[0] = 0.0F;
  glm::vec3 normal(0.0F);
  float lengths = 0.0F;
  for (std::uint32_t i = 0; i < size; ++i) {
    const float squared = glm::dot(spokes_[i], spokes_[i]);
    lengths += std::sqrt(squared);
    reach_sums_[i + 1] = reach_sums_[i] + squared;
    normal += glm::cross(spokes_[i], spokes_[wrap(i + 1)]);  // zero beside the gap
  }
  for (std::uint32_t i = 0; i < size; ++i) reach_sums_[size + i + 1] = reach_sums_[size] + reach_sums_[i + 1];
  const float length = std::sqrt(glm::dot(normal, normal));
  normal_ = length > 0.0F ? normal / length : glm::vec3(0.0F, 0.0F, 1.0F);
  float bend = 0.0F;
  for (const glm::vec3& spoke : spokes_) bend += std::fabs(glm::dot(spoke, normal_));
  const float count = static_cast<float>(is_open() ? size - 1 : size);
  mean_length_ = lengths / count;
  bend_ = bend / count;
}

// Long spokes inside the arc speak for it, long wings against it: wings are neighbours of both centres.
float RingGeometry::reach(std::uint32_t length, std::uint32_t first) const {
  const float inside = reach_sums_[first + length] - reach_sums_[first + 1];
  const float with_wings = reach_sums_[first + length + 1] - reach_sums_[first];
  return 1.4F * inside - 0.4F * with_wings;
}

std::uint32_t RingGeometry::rank_of_first(std::uint32_t length, std::uint32_t first) const {
  const float own = reach(length, first);
  std::uint32_t rank = 0;
  for (std::uint32_t i = 0; i < size(); ++i) {
    const float other = reach(length, i);
    rank += static_cast<std::uint32_t>(other > own || (other == own && i < first));
  }
  return rank;
}

std::uint32_t RingGeometry::first_of_rank(std::uint32_t length, std::uint32_t rank) const {
  reaches_.resize(size());
  for (std::uint32_t i = 0; i < size(); ++i) reaches_[i] = reach(length, i);
  for (std::uint32_t round = 0;; ++round) {
    std::uint32_t best = 0;
    for (std::uint32_t i = 1; i < size(); ++i) {
      if (reaches_[i] > reaches_[best]) best = i;
    }
    if (round == rank) return best;
    reaches_[best] = -std::numeric_limits<float>::infinity();
  }
}

}  // namespace fanstream
